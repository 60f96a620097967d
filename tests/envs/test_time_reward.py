"""The reward of v1: how much less time is left."""

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.registry import registered_controllers
from defmanip_gym.envs.registration import QUICK_ENV_ID, ROBUST_ENV_ID
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.task_params import StartParams

STEPS = 700
WEIGHT_PER_S = 10.0


def drive(name, starts, make_batch):
    """Return rewards of ``reward_time_to_go``, (steps, n), and when each arrived, (n,)."""
    env = make_batch(len(starts), env_id=QUICK_ENV_ID, autoreset_mode="Disabled")
    controller = make_controller(registered_controllers()[name], env.unwrapped.config)
    observation, _ = env.reset(options={"start": starts})
    state, begins = None, np.ones(len(starts), dtype=bool)
    running, arrived, rewards = begins.copy(), np.zeros(len(starts), dtype=int), []
    while running.any() and len(rewards) < STEPS:
        actions, state = controller.predict(observation, state, begins)
        begins = np.zeros_like(begins)
        observation, _, ended, _, info = env.step(np.where(running[:, None], actions, 0.0))
        rewards.append(np.where(running, info["reward_time_to_go"], 0.0))
        arrived[running & info["is_success"]] = len(rewards)
        running &= ~ended
    return np.array(rewards), arrived


def test_what_is_yet_to_be_had_is_about_the_time_that_field_takes(make_batch):
    starts = np.array([scenario.start for scenario in suite_named("nominal").scenarios[:16]])
    rewards, arrived = drive("field", starts, make_batch)
    assert (arrived > 0).all()
    for seconds, error in ((5.0, 1.2), (4.0, 0.3), (3.0, 0.3), (2.0, 0.4), (1.0, 0.7)):
        steps = round(seconds / 0.02)
        left = [rewards[end - steps :, i].sum() for i, end in enumerate(arrived)]
        np.testing.assert_allclose(np.divide(left, WEIGHT_PER_S), seconds, atol=error)


def test_whoever_follows_the_ways_comes_closer_all_the_time(make_batch):
    starts = np.array([scenario.start for scenario in suite_named("far").scenarios[:16]])
    rewards, arrived = drive("field", starts, make_batch)
    assert (arrived > 0).all()
    seconds = rewards[: 50 * (len(rewards) // 50)].reshape(-1, 50, len(starts)).sum(axis=1)
    under_way = np.arange(len(seconds))[:, None] * 50 + 100 < arrived
    assert (seconds[under_way] > 0).mean() > 0.98


def test_nothing_else_but_arriving_failing_and_effort_is_rewarded():
    env = gymnasium.make(QUICK_ENV_ID)
    env.reset(seed=0)
    _, reward, _, _, info = env.step(np.ones(3))
    told = {name: value for name, value in info.items() if name.startswith("reward_")}
    assert reward == pytest.approx(sum(told.values()))
    assert {n for n, value in told.items() if value} == {"reward_time_to_go", "reward_effort"}


def test_the_robust_environment_draws_what_it_says():
    env = gymnasium.make(ROBUST_ENV_ID)
    masses, distances = [], []
    for seed in range(40):
        _, info = env.reset(seed=seed)
        masses.append(info["beam_mass_kg"])
        distances.append(info["distance_to_goal"])
    assert min(masses) < 2.2 < 5.0 < max(masses)
    assert min(distances) < 4 < 14 < max(distances)
    assert env.unwrapped.config.task.start == StartParams(distance_m=(0.5, 18.0))
