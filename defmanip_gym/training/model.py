"""SB3 models from hyperparameters."""

from __future__ import annotations

from copy import deepcopy
from inspect import signature
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
from defmanip_gym.training.hyperparameters import NOT_FOR_THE_ALGORITHM, built, components
from defmanip_gym.validation import require_choice, require_non_negative, require_positive

_CLASSES: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC, "td3": TD3, "tqc": TQC}

# what SB3 and torch raise for arguments that they do not take
_REFUSALS = (
    TypeError,
    ValueError,
    LookupError,
    AttributeError,
    ArithmeticError,
    AssertionError,
    RuntimeError,
)


def build_model(
    algo: str, seed: int, hyperparameters: dict[str, Any], venv: VecNormalize
) -> BaseAlgorithm:
    """Return an untrained model.

    Raises:
        ParameterError: hyperparameters that the algorithm does not take.
    """
    kind = _CLASSES[ALGORITHM_OF[algo]]
    # a copy, as SB3 adds to policy_kwargs
    arguments = {
        key: deepcopy(value)
        for key, value in hyperparameters.items()
        if key not in NOT_FOR_THE_ALGORITHM
    }
    noise = hyperparameters.get("noise_type")
    if noise is not None:
        require_choice("noise_type", noise, ("normal",))
        deviation: Any = hyperparameters.get("noise_std")
        deviation = require_non_negative("noise_std", deviation)
        size = venv.action_space.shape[0]  # type: ignore[index]
        normal = NormalActionNoise(np.zeros(size), np.full(size, deviation))
        arguments["action_noise"] = VectorizedActionNoise(normal, venv.num_envs)
    _require_numbers(kind, arguments)
    arguments["learning_rate"] = _schedule(arguments["learning_rate"])
    policy = arguments.pop("policy")
    try:
        return kind(policy, venv, seed=seed, device="cpu", verbose=0, **arguments)
    except _REFUSALS as error:
        raise ParameterError(
            "hyperparameters", arguments, f"arguments of {ALGORITHM_OF[algo].upper()}", f"{error}"
        ) from error


def callbacks_of(hyperparameters: dict[str, Any]) -> list[BaseCallback]:
    """Return the callbacks that hyperparameters name.

    Raises:
        ParameterError: an entry that names no callback, or arguments that it does not take.
    """
    callbacks = []
    for kind, options in components(hyperparameters, "callback"):
        if not (isinstance(kind, type) and issubclass(kind, BaseCallback)):
            raise ParameterError(
                "callback", kind, "the dotted path of an SB3 callback", "Check the spelling."
            )
        callbacks.append(built("callback", kind, (), options))
    return callbacks


def _require_numbers(kind: type[BaseAlgorithm], arguments: dict[str, Any]) -> None:
    """Raise ParameterError for text where the algorithm has a number; SB3 meets it in training."""
    for key, parameter in signature(kind).parameters.items():
        value, default = arguments.get(key), parameter.default
        is_number = isinstance(default, int | float) and not isinstance(default, bool)
        if is_number and isinstance(value, str) and key != "learning_rate":
            raise ParameterError(
                key, value, "a number", "To YAML 1e-3 is text, and 1.0e-3 a number."
            )


def _schedule(rate: Any) -> float | LinearSchedule:
    """Return a learning rate, or rl-zoo3's ``lin_x``: from x down to zero over the run."""
    falls = isinstance(rate, str) and rate.startswith("lin_")
    try:
        start = float(rate.removeprefix("lin_") if falls else rate)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            "learning_rate", rate, "a number > 0, or lin_ and a number", "See the package's files."
        ) from error
    start = require_positive("learning_rate", start)
    return LinearSchedule(start, 0.0, 1.0) if falls else start
