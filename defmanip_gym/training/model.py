"""SB3 models from hyperparameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.noise import NormalActionNoise, VectorizedActionNoise
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.errors import ParameterError
from defmanip_gym.training.config import ALGORITHM_OF
from defmanip_gym.training.hyperparameters import NOT_FOR_THE_ALGORITHM, components

_CLASSES: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC, "td3": TD3, "tqc": TQC}


def build_model(
    algo: str, seed: int, hyperparameters: dict[str, Any], venv: VecNormalize
) -> BaseAlgorithm:
    """Return an untrained model.

    Raises:
        ParameterError: hyperparameters that the algorithm does not take.
    """
    arguments = {
        key: value for key, value in hyperparameters.items() if key not in NOT_FOR_THE_ALGORITHM
    }
    if hyperparameters.get("noise_type") == "normal":
        size = venv.action_space.shape[0]  # type: ignore[index]
        deviation = float(hyperparameters["noise_std"]) * np.ones(size)
        noise = NormalActionNoise(np.zeros(size), deviation)
        arguments["action_noise"] = VectorizedActionNoise(noise, venv.num_envs)
    arguments["learning_rate"] = _schedule(arguments["learning_rate"])
    policy = arguments.pop("policy")
    try:
        return _CLASSES[ALGORITHM_OF[algo]](
            policy, venv, seed=seed, device="cpu", verbose=0, **arguments
        )
    except (TypeError, ValueError, AssertionError) as error:
        raise ParameterError(
            "hyperparameters", arguments, f"arguments of {ALGORITHM_OF[algo].upper()}", f"{error}"
        ) from error


def callbacks_of(hyperparameters: dict[str, Any]) -> list[BaseCallback]:
    """Return the callbacks that hyperparameters name."""
    return [kind(**options) for kind, options in components(hyperparameters, "callback")]


def _schedule(rate: float | str) -> float | LinearSchedule:
    """Return a learning rate, or rl-zoo3's ``lin_x``: from x down to zero over the run."""
    if isinstance(rate, str) and rate.startswith("lin_"):
        return LinearSchedule(float(rate.removeprefix("lin_")), 0.0, 1.0)
    return float(rate)
