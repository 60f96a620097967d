"""The inner loop that measures the force on the plant: what the grasp does of what is asked."""

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.field import FieldController, FieldParams
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, DisturbanceParams

NOMINAL = BeamParams(damping=0.0)
GOAL = (0.0, 0.0, 0.0, np.pi / 2, -np.pi / 2)
PERIOD_S = 0.02


def velocities(env, layout, w, swing=0.1):
    """Return the grasp's velocity after each command of w, (steps + 1, 3) m/s."""
    observation, _ = env.reset(options={"start": (*GOAL, swing)})
    found = [layout.part(observation, "grasp_velocity_b")[0]]
    for command in w:
        observation, *_ = env.step(command[None] / 3.0)
        found.append(layout.part(observation, "grasp_velocity_b")[0])
    return np.array(found)


def largest_error(make_batch, beam, inner_loop):
    """Return by how much accelerations miss steps of w forward and upward, m/s²."""
    env = make_batch(beam=beam, nominal_beam=NOMINAL, inner_loop=inner_loop)
    w = np.zeros((40, 3))
    w[:, 0] = np.where(np.arange(40) % 10 < 5, 0.8, -0.8)
    w[:, 2] = np.where(np.arange(40) % 8 < 4, 0.3, -0.3)
    found = np.diff(velocities(env, ObservationLayout(1), w), axis=0) / PERIOD_S
    return np.abs(found - w)[:, [0, 2]].max()


@pytest.mark.parametrize("factor", [0.2, 0.5, 1.0, 2.0, 4.0])
def test_it_does_what_is_asked_with_objects_that_nobody_believes_in(make_batch, factor):
    beam = BeamParams(mass_kg=factor * NOMINAL.mass_kg)
    assert largest_error(make_batch, beam, "measured_force") < 0.12


def test_the_believed_weight_drops_a_heavier_object(make_batch):
    beam = BeamParams(mass_kg=1.3 * NOMINAL.mass_kg)
    assert largest_error(make_batch, beam, "model") > 1.0


def test_noise_of_the_sensor_moves_the_grasp_as_much_as_the_sampled_loop_says(make_batch):
    noise_n, layout = 2.0, ObservationLayout(1)
    env = make_batch(
        16,
        inner_loop="measured_force",
        disturbance=DisturbanceParams(force_sensor_noise_n=noise_n),
    )
    controller = FieldController(params=FieldParams(following_rate=0.0))
    observation, _ = env.reset(seed=0, options={"start": (*GOAL, 0.0)})
    state, found = None, []
    for step in range(400):
        action, state = controller.predict(observation, state)
        observation, *_ = env.step(action)
        if step >= 100:
            found.append(layout.part(observation, "grasp_velocity_b"))
    predicted = controller.observed_loop().velocity_deviation(noise_n)
    measured = np.array(found).std(axis=(0, 1))
    np.testing.assert_allclose(measured[[0, 2]], predicted[[0, 2]], rtol=0.2)
