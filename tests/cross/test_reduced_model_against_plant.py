"""The planner's model against the plant with its inner loop."""

from __future__ import annotations

import gymnasium
import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import grasp_sample
from defmanip_gym.baselines.analytic.planner_state import planner_states
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.planning.forces import force_shares
from defmanip_gym.planning.model import HEADING, SWING, SWING_RATE, advanced_rows, state_rates
from defmanip_gym.planning.plan_file import shipped_plans
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.theory.dynamics.robot_model import ArmKinematics


def test_the_model_foresees_a_second_of_the_plant():
    env = gymnasium.make("defmanip_gym:DeformTransport-v0")
    observation, _ = env.reset(options={"start": "paper"})
    setting = PlanningSetting()
    layout, arm = ObservationLayout(1), ArmKinematics(setting.robot)
    task = setting.task
    generator = np.random.default_rng(0)
    state = planner_states(grasp_sample(observation[None], layout, arm))
    largest = np.zeros(11)
    for k in range(50):
        if k % 10 == 0:
            action = generator.uniform(-0.4, 0.4, 3)
        state = advanced_rows(
            setting.model, state, task.max_acceleration_m_s2 * action[None], task.control_period_s
        )
        observation, *_ = env.step(action)
        error = np.abs(planner_states(grasp_sample(observation[None], layout, arm)) - state)[0]
        largest = np.maximum(largest, error)
    env.close()
    assert largest[:3].max() < 0.02
    assert largest[4:7].max() < 0.05
    assert largest[HEADING] < 0.03
    assert largest[SWING] < 0.02 and largest[SWING_RATE] < 0.1


def test_planned_forces_keep_to_the_robots_limits():
    setting = PlanningSetting()
    largest = np.max([force_shares(setting, p.drive).max(axis=0) for p in shipped_plans().plans], 0)
    drive, *others = largest
    assert 0.9 < drive < 1.03  # the planner's short form of it is 2 % off
    assert max(others) < 0.5


def test_the_planners_drive_force_is_that_of_the_linearization():
    setting = PlanningSetting()
    drive = setting.limits().drive
    for stored in shipped_plans().plans[::10]:
        states, w = stored.drive.states[:-1], stored.drive.commands
        columns, rates = tuple(states.T), state_rates(setting.model, tuple(states.T), tuple(w.T))
        found = np.abs(drive.force(columns, rates, w[:, 0])) / drive.force_n
        np.testing.assert_allclose(found, force_shares(setting, stored.drive)[:, 0], atol=0.03)
