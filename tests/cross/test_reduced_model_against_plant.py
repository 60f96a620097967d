"""The planner's model against the plant with its inner loop."""

from __future__ import annotations

import gymnasium
import numpy as np

from defmanip_gym.baselines.analytic.time_optimal import TimeOptimalController
from defmanip_gym.planning.model import HEADING, SWING, SWING_RATE, advanced_rows
from defmanip_gym.planning.setting import PlanningSetting


def test_the_model_foresees_a_second_of_the_plant():
    env = gymnasium.make("defmanip_gym:DeformTransport-v0")
    observation, _ = env.reset(options={"start": "paper"})
    controller, setting = TimeOptimalController(), PlanningSetting()
    task = setting.task
    generator = np.random.default_rng(0)
    state = controller.states(observation[None])
    largest = np.zeros(11)
    for k in range(50):
        if k % 10 == 0:
            action = generator.uniform(-0.4, 0.4, 3)
        state = advanced_rows(
            setting.model, state, task.max_acceleration_m_s2 * action[None], task.control_period_s
        )
        observation, *_ = env.step(action)
        error = np.abs(controller.states(observation[None]) - state)[0]
        largest = np.maximum(largest, error)
    env.close()
    assert largest[:3].max() < 0.02
    assert largest[4:7].max() < 0.05
    assert largest[HEADING] < 0.03
    assert largest[SWING] < 0.02 and largest[SWING_RATE] < 0.1


def test_planned_forces_stay_far_from_the_robots_limits():
    from defmanip_gym.planning.forces import force_shares
    from defmanip_gym.planning.stored import shipped_plans

    setting = PlanningSetting()
    for stored in shipped_plans().plans[::10]:
        assert force_shares(setting, stored.drive).max() < 1.0
