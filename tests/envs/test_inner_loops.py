"""The inner loop that measures the force: what it feels is the sensor's, and its own."""

import gymnasium
import numpy as np
import pytest

from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, DisturbanceParams

NOISE = DisturbanceParams(force_sensor_noise_n=1.0)


def course(env, steps=30, spoil=False):
    """Return observations under changing actions; ``spoil`` writes into each afterwards."""
    observation, _ = env.reset(seed=4)
    told = [observation.copy()]
    for step in range(steps):
        if spoil:
            observation[:] = 7.0
        action = np.full(env.action_space.shape, 0.4 * np.sin(0.4 * step))
        observation, *_ = env.step(action)
        told.append(observation.copy())
    env.close()
    return np.array(told)


def felt(make_batch, count=1, **arguments):
    return make_batch(count, inner_loop="measured_force", **arguments)


def test_noise_of_the_force_sensor_moves_the_robot(make_batch):
    quiet, noisy = (
        course(felt(make_batch, disturbance=noise))[:, 0, 5:8]
        for noise in (DisturbanceParams(), NOISE)
    )
    assert np.abs(noisy - quiet).max() > 1e-3


def test_noise_of_the_force_sensor_does_not_move_it_on_the_other_inner_loop(make_batch):
    quiet, noisy = (
        course(make_batch(1, disturbance=noise))[:, 0, 5:8]
        for noise in (DisturbanceParams(), NOISE)
    )
    np.testing.assert_array_equal(noisy, quiet)


def test_whoever_writes_into_observations_changes_nothing(make_batch):
    clean, spoilt = (
        course(felt(make_batch, 2, disturbance=NOISE), spoil=spoil) for spoil in (False, True)
    )
    np.testing.assert_array_equal(clean, spoilt)


@pytest.mark.parametrize("count", [1, 7])
def test_an_episode_does_not_depend_on_its_batch(make_batch, count):
    beam = BeamParams(mass_kg=5.0)
    single = course(DeformTransportEnv(inner_loop="measured_force", beam=beam))
    batch = course(felt(make_batch, count, beam=beam))
    np.testing.assert_array_equal(batch[:, 0], single)


def test_a_planner_that_believes_in_a_beam_goes_on_from_the_state_of_one_that_feels_it(make_batch):
    feeling, believing = felt(make_batch), make_batch()
    for env in (feeling, believing):
        env.reset(seed=0)
    for source, target in ((feeling, believing), (believing, feeling)):
        target.unwrapped.set_state(source.unwrapped.get_state())
        observation, *_ = target.step(np.zeros((1, 3)))
        assert np.isfinite(observation).all()


def test_in_force_mode_there_is_no_inner_loop(make_batch):
    pushed, felt_too = (
        course(make_batch(1, control_mode="force", inner_loop=kind), steps=5)
        for kind in ("model", "measured_force")
    )
    np.testing.assert_array_equal(pushed, felt_too)


def test_unknown_inner_loops_are_refused():
    with pytest.raises(ParameterError, match="inner_loop"):
        gymnasium.make("defmanip_gym:DeformTransport-v0", inner_loop="none")
