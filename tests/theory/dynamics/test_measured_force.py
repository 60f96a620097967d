"""The measured force takes the place of a model of the object: Eqs. (2), (3) against Eq. (28)."""

import numpy as np
import pytest

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.measured_force import MeasuredForceLinearization, weighed_mass
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.payload.object_model import HangingBeam

COUNT = 20
RNG = np.random.default_rng(0)
JOINTS = np.array([np.pi / 3, -np.pi / 2]) + RNG.uniform(-0.2, 0.2, (COUNT, 2))
RATES = RNG.uniform(-1, 1, (COUNT, 2))
FORWARD_ONLY = np.stack((RNG.uniform(-2, 2, COUNT), np.zeros(COUNT)), axis=1)
ALONG = RNG.uniform(-3, 3, (COUNT, 3)) * [1, 0, 1]
BEFORE = RNG.uniform(-3, 3, (COUNT, 3)) * [1, 0, 1]
RESOLUTION = RedundancyResolution(RobotParams(), goal_reach_m=0.7)


def forces_without_a_model(beam, swing, swing_rate, read_under, mass_kg):
    force_b = HangingBeam(beam).linearizing_force(swing, swing_rate, np.zeros(COUNT), read_under)
    return MeasuredForceLinearization(RobotParams(), RESOLUTION).generalized_forces(
        ALONG, JOINTS, RATES, FORWARD_ONLY, force_b, read_under, mass_kg, swing[:, 0]
    )


@pytest.mark.parametrize("mass_kg", [0.3, 3.1, 12.0])
@pytest.mark.parametrize("read_under", [ALONG, BEFORE], ids=["w itself", "another acceleration"])
def test_for_a_rod_it_is_equation_28_with_the_right_model(mass_kg, read_under):
    beam = BeamParams(mass_kg=mass_kg, length_m=0.7)
    swing, swing_rate = RNG.uniform(-0.6, 0.6, (2, COUNT, 1))
    expected = FeedbackLinearization(RobotParams(), beam, RESOLUTION).generalized_forces(
        ALONG, JOINTS, RATES, FORWARD_ONLY, swing, swing_rate
    )
    found = forces_without_a_model(beam, swing, swing_rate, read_under, np.full(COUNT, mass_kg))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_segments_need_no_model_either_where_the_force_was_read_under_the_same_acceleration():
    beam = BeamParams(segment_count=5)
    swing, swing_rate = RNG.uniform(-0.3, 0.3, (2, COUNT, 5))
    expected = FeedbackLinearization(RobotParams(), beam, RESOLUTION).generalized_forces(
        ALONG, JOINTS, RATES, FORWARD_ONLY, swing, swing_rate
    )
    found = forces_without_a_model(beam, swing, swing_rate, ALONG, np.zeros(COUNT))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_rod_at_rest_is_weighed_at_any_swing():
    beam, swing = BeamParams(mass_kg=4.2), np.linspace(-0.9, 0.9, COUNT)[:, None]
    at_rest = np.zeros((COUNT, 1))
    force_b = HangingBeam(beam).linearizing_force(
        swing, at_rest, np.zeros(COUNT), np.zeros((COUNT, 3))
    )
    mass_kg = weighed_mass(force_b[:, 0], force_b[:, 2], swing[:, 0])
    np.testing.assert_allclose(mass_kg, 4.2, rtol=1e-12)
