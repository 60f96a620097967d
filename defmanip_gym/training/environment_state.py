"""What the future of an SB3 environment's episodes depends on."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from defmanip_gym.training.sb3_vec_env import Sb3VecEnv


def environment_state(venv: VecEnv) -> dict[str, Any] | None:
    """Return the state of the running episodes and their generators; None: they cannot go on."""
    return _innermost(venv).get_state()


def set_environment_state(venv: VecEnv, state: dict[str, Any] | None) -> None:
    """Go on from what ``environment_state`` returned, or let new episodes begin."""
    if state is not None:
        _innermost(venv).set_state(state)


def _innermost(venv: VecEnv) -> Sb3VecEnv:
    while isinstance(venv, VecEnvWrapper):
        venv = venv.venv
    assert isinstance(venv, Sb3VecEnv)
    return venv
