"""SB3 sees the batch as it expects environments to be."""

import gymnasium
import numpy as np
import pytest

from defmanip_gym.errors import ParameterError
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv

ENV_ID = "defmanip_gym:DeformTransport-v0"


def make(count=3, **arguments):
    return Sb3VecEnv(gymnasium.make_vec(ENV_ID, num_envs=count, **arguments))


def test_truncation_is_marked_and_the_final_observation_handed_over():
    venv, plain = make(max_episode_steps=4), make(max_episode_steps=9)
    for env in (venv, plain):
        env.seed(5)
        env.reset()
    for _ in range(4):
        observation, _, done, infos = venv.step(np.full((3, 3), 0.1))
        expected, *_ = plain.step(np.full((3, 3), 0.1))
    assert done.all()
    for index, info in enumerate(infos):
        assert info["TimeLimit.truncated"] is True
        assert np.array_equal(info["terminal_observation"], expected[index])
        assert info["episode"]["l"] == 4
    assert not np.array_equal(observation, expected)


def test_termination_is_not_marked_as_truncation():
    venv = make(1)
    venv.reset()
    for _ in range(80):
        *_, done, infos = venv.step(np.array([[1.0, 0.0, 0.0]]))
        if done[0]:
            break
    assert infos[0]["TimeLimit.truncated"] is False
    assert infos[0]["episode"]["cost"] == 1.0


def test_episode_return_is_the_sum_of_rewards():
    venv = make(1, max_episode_steps=6)
    venv.reset()
    rewards = [venv.step(np.zeros((1, 3)))[1][0] for _ in range(5)]
    _, reward, _, infos = venv.step(np.zeros((1, 3)))
    assert infos[0]["episode"]["r"] == pytest.approx(sum(rewards) + reward[0], rel=1e-5)


def test_seeds_reach_the_episodes():
    first, second = make(), make()
    first.seed(3)
    second.seed(3)
    assert np.array_equal(first.reset(), second.reset())
    second.seed(4)
    assert not np.array_equal(first.reset(), second.reset())


def test_other_reset_modes_are_refused():
    with pytest.raises(ParameterError, match="SAME_STEP"):
        make(autoreset_mode="NextStep")
