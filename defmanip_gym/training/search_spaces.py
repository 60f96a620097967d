"""What a study may vary in each recipe; everything else stays as in its hyperparameter file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from optuna import Trial

Hyperparameters = dict[str, Any]

_LAGRANGIAN = "defmanip_gym.training.lagrangian.LagrangianPenalty"
_RISING = "defmanip_gym.training.rising_discount.RisingDiscount"


def on_policy(trial: Trial, file: Hyperparameters) -> Hyperparameters:
    """Return PPO's changes to what the file has."""
    rate = trial.suggest_float("learning_rate", 3e-4, 3e-3, log=True)
    return _horizon(trial, file) | {
        "learning_rate": f"lin_{rate:.3g}",
        "n_steps": trial.suggest_categorical("n_steps", [16, 32, 64]),
        "n_epochs": trial.suggest_int("n_epochs", 4, 12, step=4),
        "clip_range": trial.suggest_categorical("clip_range", [0.1, 0.2, 0.3]),
        "policy_kwargs": file["policy_kwargs"]
        | {"log_std_init": trial.suggest_float("log_std_init", -1.5, 0.0)},
    }


def off_policy(trial: Trial, file: Hyperparameters) -> Hyperparameters:
    """Return changes for algorithms that learn from a replay buffer."""
    rate = trial.suggest_float("learning_rate", 3e-4, 3e-3, log=True)
    return _horizon(trial, file) | {
        "learning_rate": f"lin_{rate:.3g}",
        "tau": trial.suggest_categorical("tau", [0.005, 0.01, 0.02]),
        "batch_size": trial.suggest_categorical("batch_size", [256, 512, 1024]),
        "gradient_steps": trial.suggest_categorical("gradient_steps", [2, 4, 8]),
        "n_steps": trial.suggest_categorical("n_steps", [1, 3, 5]),
        "target_entropy": trial.suggest_float("target_entropy", -3.0, 1.5),
    }


def lagrangian(trial: Trial, file: Hyperparameters) -> Hyperparameters:
    """Return PPO's changes and those of the dual ascent."""
    options = {
        "cost_limit": 0.1,
        "multiplier": 0.0,
        "largest_multiplier": trial.suggest_float("largest_multiplier", 0.1, 3.0, log=True),
        "learning_rate": trial.suggest_float("multiplier_rate", 1e-4, 1e-2, log=True),
    }
    return on_policy(trial, file) | {"callback": [{_LAGRANGIAN: options}]}


def _horizon(trial: Trial, file: Hyperparameters) -> Hyperparameters:
    """Return another discount, and where the file's rises, another one at the end, too."""
    changes: Hyperparameters = {
        "gamma": 1.0 - trial.suggest_float("one_minus_gamma", 5e-3, 8e-2, log=True)
    }
    callbacks = file.get("callback", [])
    if any(isinstance(each, dict) and _RISING in each for each in callbacks):
        last = 1.0 - trial.suggest_float("one_minus_last_gamma", 3e-3, 3e-2, log=True)
        changes["callback"] = [
            {_RISING: each[_RISING] | {"gamma": last}}
            if isinstance(each, dict) and _RISING in each
            else each
            for each in callbacks
        ]
    return changes


SEARCH_SPACES: dict[str, Callable[[Trial, Hyperparameters], Hyperparameters]] = {
    "ppo": on_policy,
    "residual": on_policy,
    "lagrangian": lagrangian,
    "sac": off_policy,
    "tqc": off_policy,
}
