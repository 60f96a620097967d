from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.errors import GainError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams
from defmanip_gym.theory.control.disturbance_observer import (
    DisturbanceObserver,
    ObserverMemory,
    weight_disturbance,
)
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base
from defmanip_gym.theory.dynamics.task_space import task_inertia

PERIOD_S = 0.02
OBSERVER = DisturbanceObserver(gain=5.0, period_s=PERIOD_S, w_limit=3.0, max_speed_m_s=2.0)


def run(disturbance, u_o, yaw_rate, samples):
    """Let v̇ = w + disturbance (base frame half-way) and return d after each sample."""
    heading, velocity_w = 0.0, np.zeros((1, 3))
    memory = ObserverMemory(
        estimate=np.zeros((1, 3)), w=np.zeros((1, 3)), velocity=np.zeros((1, 3))
    )
    estimates = []
    for sample in range(samples):
        angle = np.array([heading])
        velocity_b = world_to_base(velocity_w, angle)
        estimate = memory.estimate
        if sample:
            estimate = OBSERVER.updated(memory, velocity_b, angle, np.array([yaw_rate]))
        estimates.append(estimate[0])
        memory = OBSERVER.command(u_o, estimate, velocity_b, angle)
        halfway = angle + 0.5 * PERIOD_S * yaw_rate
        velocity_w = velocity_w + PERIOD_S * base_to_world(memory.w + disturbance, halfway)
        heading += PERIOD_S * yaw_rate
    return np.array(estimates)


@pytest.mark.parametrize("yaw_rate", [0.0, 1.5])
def test_a_constant_disturbance_is_found_at_the_observers_rate_also_while_turning(yaw_rate):
    disturbance = np.array([[0.3, -0.2, 0.1]])
    estimates = run(disturbance, np.array([[0.1, 0.2, -0.1]]), yaw_rate, 60)
    left = (1 - OBSERVER.gain * PERIOD_S) ** np.arange(60)[:, None]
    np.testing.assert_allclose(estimates, (1 - left) * disturbance, atol=1e-12)


def test_what_limits_take_away_is_no_disturbance():
    estimates = run(np.zeros((1, 3)), np.array([[5.0, 0.0, 0.0]]), 0.0, 100)
    np.testing.assert_allclose(estimates, 0.0, atol=1e-12)


def test_the_first_reading_tells_what_another_weight_will_do():
    believed, carried = BeamParams(), BeamParams(mass_kg=5.0)
    pitch = np.array([[1.2, -0.3]])
    weight = carried.mass_kg * GRAVITY_M_S2
    found = weight_disturbance(RobotParams(), believed, pitch, np.array([[0.0, 0.0, weight]]))
    inertia = task_inertia(RobotParams(), pitch)[0] + np.diag((0.0, 0.0, carried.mass_kg))
    missing = (believed.mass_kg - carried.mass_kg) * GRAVITY_M_S2
    np.testing.assert_allclose(inertia @ found[0], [0.0, 0.0, missing], atol=1e-12)


def test_a_gain_with_which_the_estimate_grows_by_itself_is_refused():
    with pytest.raises(GainError, match="100 1/s"):
        replace(OBSERVER, gain=2.0 / PERIOD_S)
    replace(OBSERVER, gain=1.99 / PERIOD_S)
