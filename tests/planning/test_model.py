"""The reduced model against the theory that it is a short form of."""

from __future__ import annotations

import numpy as np
import pytest

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.planning.model import (
    HEADING,
    REACH,
    REACH_RATE,
    SWING,
    SWING_RATE,
    TransportModel,
    advanced_rows,
    state_rates,
)
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import ArmKinematics
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.passivity import storage

BEAM = BeamParams(root_stiffness=3.0)
MODEL = TransportModel.of(RobotParams(), BEAM, 0.7)


def states(count=20):
    generator = np.random.default_rng(0)
    made = generator.uniform(-1.0, 1.0, (count, 11))
    made[:, REACH] = generator.uniform(0.5, 0.9, count)
    made[:, SWING] *= 0.5
    return made, generator.uniform(-3.0, 3.0, (count, 3))


def rates(made, w):
    return np.stack(state_rates(MODEL, tuple(made.T), tuple(w.T)), axis=-1)


def test_the_swing_obeys_equation_6b():
    made, w = states()
    beam, swing, rate = HangingBeam(BEAM), made[:, SWING : SWING + 1], made[:, SWING_RATE:]
    partition = beam.partition(swing, rate, made[:, 5] / made[:, REACH])
    torque = beam.internal_torque(partition, swing, rate)
    torque += np.einsum("nij,ni->nj", partition.m_o12, w)
    expected = -torque / partition.m_o22[..., 0]
    np.testing.assert_allclose(rates(made, w)[:, SWING_RATE:], expected, rtol=1e-12, atol=1e-12)


def test_grasp_and_reach_move_as_base_and_arm_make_them():
    made, w = states()
    arm = ArmKinematics(RobotParams())
    pitch = np.tile((1.2, -0.3), (len(made), 1)) + 0.2 * made[:, :2]
    pitch_rate = made[:, 2:4]
    reach = arm.reach_and_height(pitch)[:, 0]
    reach_rate = (arm.jacobian(pitch)[:, 0] * pitch_rate).sum(axis=1)
    base = np.stack((made[:, 4], made[:, 5] / reach), axis=-1)
    resolution = RedundancyResolution(RobotParams(), goal_reach_m=0.7)
    u = resolution.accelerations(w, pitch, pitch_rate, base)
    made[:, REACH], made[:, REACH_RATE] = reach, reach_rate
    made[:, 4], made[:, 5] = base[:, 0] + reach_rate, reach * base[:, 1]
    made[:, 6] = (arm.jacobian(pitch)[:, 1] * pitch_rate).sum(axis=1)
    bias = arm.bias_acceleration(pitch, pitch_rate)
    arm_rates = np.einsum("nij,nj->ni", arm.jacobian(pitch), u[:, 2:]) + bias
    found = rates(made, w)
    np.testing.assert_allclose(found[:, REACH_RATE], arm_rates[:, 0], atol=1e-9)
    np.testing.assert_allclose(found[:, 6], arm_rates[:, 1], atol=1e-9)
    np.testing.assert_allclose(found[:, 4], u[:, 0] + arm_rates[:, 0], atol=1e-9)
    leftward = reach_rate * base[:, 1] + reach * u[:, 1]
    np.testing.assert_allclose(found[:, 5], leftward, atol=1e-9)
    np.testing.assert_allclose(found[:, HEADING], base[:, 1], atol=1e-12)


def test_storage_is_that_of_the_lemma_over_the_inertia():
    made, _ = states()
    beam = HangingBeam(BEAM)
    inertia = BEAM.mass_kg * BEAM.length_m**2 / 3
    expected = storage(beam, made[:, SWING : SWING + 1], made[:, SWING_RATE:]) / inertia
    np.testing.assert_allclose(MODEL.storage(made[:, SWING], made[:, SWING_RATE]), expected)


def test_a_long_step_is_many_short_ones_to_fourth_order():
    made, w = states()
    small = made
    for _ in range(32):
        small = advanced_rows(MODEL, small, w, 0.05 / 32)
    errors = [
        np.abs(advanced_rows(MODEL, made, w, 0.05) - small).max(),
        np.abs(advanced_rows(MODEL, advanced_rows(MODEL, made, w, 0.025), w, 0.025) - small).max(),
    ]
    assert errors[0] < 1e-4 and errors[1] < errors[0] / 8


def test_beams_of_several_segments_are_refused():
    with pytest.raises(ParameterError, match="rigid rods"):
        TransportModel.of(RobotParams(), BeamParams(segment_count=2), 0.7)
