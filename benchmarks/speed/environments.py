"""Environments as candidates: stored actions, and a reset whenever an episode ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.registration import ENV_ID as NAME
from turns import Candidate

ENV_ID = f"defmanip_gym:{NAME}"


class StoredActions:
    """Random actions, over and over: sampling a space costs as much as a step.

    Args:
        space: of a single environment.
        num_envs: rows of each action, or None for a single environment's.
    """

    def __init__(self, space: gymnasium.Space[Any], num_envs: int | None = None) -> None:
        assert isinstance(space, gymnasium.spaces.Box)
        rows = () if num_envs is None else (num_envs,)
        size = (64, *rows, *space.shape)
        values = np.random.default_rng(0).uniform(space.low, space.high, size)
        self._stored = values.astype(space.dtype)
        self._index = -1

    def __next__(self) -> NDArray[Any]:
        self._index = (self._index + 1) % len(self._stored)
        return self._stored[self._index]

    def rewind(self) -> None:
        """Begin with the first action again."""
        self._index = -1


def batched_env(num_envs: int, **options: Any) -> Any:
    """Return the batched environment as ``make_vec`` makes it, not yet started.

    Args:
        num_envs: n.
        options: the environment's own, such as ``num_threads``.
    """
    return gymnasium.make_vec(ENV_ID, num_envs=num_envs, **options).unwrapped


def vector_candidate(name: str, env: Any) -> Candidate:
    """Return a Gymnasium vector environment, which resets its episodes itself."""
    env.reset(seed=0)
    actions = StoredActions(env.single_action_space, env.num_envs)
    return Candidate(
        name=name,
        num_envs=env.num_envs,
        step=lambda: env.step(next(actions)),
        close=env.close,
    )


def sb3_candidate(name: str, env: Any) -> Candidate:
    """Return an SB3 ``VecEnv``, which resets its episodes itself."""
    env.seed(0)
    env.reset()
    actions = StoredActions(env.action_space, env.num_envs)
    return Candidate(
        name=name,
        num_envs=env.num_envs,
        step=lambda: env.step(next(actions)),
        close=env.close,
    )


def single_candidate(name: str, env: gymnasium.Env[Any, Any]) -> Candidate:
    """Return a single environment, its resets included."""
    env.reset(seed=0)
    actions = StoredActions(env.action_space)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return Candidate(name=name, step=step, close=env.close)


def single_makers(count: int, **options: Any) -> list[Callable[[], gymnasium.Env[Any, Any]]]:
    """Return functions that make the single environment, for SB3's vector environments."""
    return [lambda: gymnasium.make(ENV_ID, **options)] * count
