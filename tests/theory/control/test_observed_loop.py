import numpy as np
import pytest

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.control.observed_loop import ObservedLoop
from defmanip_gym.theory.payload.zero_dynamics import linearize

PERIOD_S = 0.02
BEAM = BeamParams()


def loop(**changes):
    return ObservedLoop(
        **{
            "robot": RobotParams(),
            "goal_pitch": np.array([np.pi / 2, 0.0]),
            "carried": linearize(BEAM),
            "believed": None,
            "tracking_gain": 4.0,
            "approach_rate": 4.0,
            "observer_gain": 5.0,
            "following_rate": 2.0,
            "period_s": PERIOD_S,
            **changes,
        }
    )


@pytest.mark.parametrize("believed", [None, linearize(BeamParams(damping=0.0))])
def test_the_loop_stands_three_periods_of_delay_and_not_five(believed):
    radii = [loop(believed=believed, delay_periods=j).spectral_radius() for j in (0, 3, 5)]
    assert max(radii[:2]) < 1 < radii[2]


@pytest.mark.parametrize("delay", [1, 3])
def test_the_observer_alone_is_stable_up_to_the_gain_that_its_delay_allows(delay):
    # d ← d + L T (δ − d[k − j]): |z| = 1 at L T = 2 sin(π / (2 (2 j + 1)))
    edge = 2 * np.sin(np.pi / (2 * (2 * delay + 1))) / PERIOD_S
    heavy = RobotParams(base_mass_kg=1e4, joint_armature_kgm2=1e4)  # hardly feels the object
    inside, outside = (
        loop(
            robot=heavy,
            tracking_gain=1e-3,
            approach_rate=1e-3,
            following_rate=0.0,
            observer_gain=share * edge,
            delay_periods=delay,
        ).spectral_radius()
        for share in (0.97, 1.03)
    )
    assert inside < 1 < outside


@pytest.mark.parametrize("factor", [0.1, 0.5, 2.0, 10.0])
@pytest.mark.parametrize("segments", [1, 4, 16])
def test_no_mass_or_number_of_segments_makes_the_measured_force_unstable(factor, segments):
    beam = BeamParams(mass_kg=factor * BEAM.mass_kg, segment_count=segments)
    assert loop(carried=linearize(beam)).spectral_radius() < 1


def test_following_the_swing_multiplies_its_damping():
    alone, following = (
        np.log(loop(following_rate=rate).spectral_radius()) / PERIOD_S for rate in (0.0, 2.0)
    )
    assert following < 3 * alone < 0


def test_only_the_loop_that_measures_the_force_passes_its_noise_on():
    modelled = loop(believed=linearize(BEAM)).velocity_deviation(0.5)
    measured = loop().velocity_deviation(0.5)
    np.testing.assert_array_equal(modelled, 0.0)
    assert (measured > 5e-4).all() and (measured < 5e-3).all()
    np.testing.assert_allclose(loop().velocity_deviation(1.0), 2 * measured)
