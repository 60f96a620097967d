"""Episodes may start at any bearing and heading, so and so far from the goal."""

import math

import gymnasium
import numpy as np
import pytest

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.envs.starts import StartSampler
from defmanip_gym.errors import ParameterError, StartError
from defmanip_gym.task_params import StartParams, TaskParams


def starts(count, distance_m=(0.5, 18.0), goal=TaskParams().goal):
    params = StartParams(distance_m=distance_m)
    generators = [np.random.default_rng(seed) for seed in range(count)]
    return StartSampler(params, generators, goal).sample(np.arange(count))


def test_they_are_all_around_the_goal_as_far_as_asked_for():
    goal = (3.0, -2.0, 1.0, *TaskParams().goal[3:])
    found = starts(400, goal=goal)
    away = found[:, :2] - goal[:2]
    distance, bearing = np.hypot(*away.T), np.arctan2(*away.T[::-1])
    assert distance.min() >= 0.5 and distance.max() <= 18.0
    for angle in (bearing, found[:, 2] - goal[2]):
        counts, _ = np.histogram(angle, bins=8, range=(-math.pi, math.pi))
        assert counts.sum() == 400 and counts.min() > 20
    quarters, _ = np.histogram(distance, bins=4, range=(0.5, 18.0))
    assert quarters.min() > 60


def test_arms_and_swings_are_drawn_as_ever():
    ring, box = starts(5), StartSampler(StartParams(), [np.random.default_rng(s) for s in range(5)])
    np.testing.assert_array_equal(ring[:, 3:], box.sample(np.arange(5))[:, 3:])


def test_an_environment_takes_them():
    task = TaskParams(start=StartParams(distance_m=(0.5, 18.0)))
    env = gymnasium.make_vec(ENV_ID, num_envs=32, task=task)
    _, info = env.reset(seed=0)
    assert info["distance_to_goal"].min() < 4.0 and info["distance_to_goal"].max() > 14.0
    env.close()


def test_those_outside_of_the_arena_are_refused_at_once():
    with pytest.raises(StartError, match="20 m"):
        gymnasium.make(ENV_ID, task=TaskParams(start=StartParams(distance_m=(1.0, 25.0))))
    with pytest.raises(ParameterError):
        StartParams(distance_m=(2.0, 1.0))
