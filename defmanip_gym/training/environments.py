"""The environments of a training run: batched, wrapped as the hyperparameters say, normalized."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.baselines.residual_base import shared_filter
from defmanip_gym.errors import DefmanipError, ParameterError
from defmanip_gym.evaluation.seeds import LARGEST_BATCH, VALIDATION_SEED
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.hyperparameters import built, components
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
from defmanip_gym.validation import require_whole
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper
from defmanip_gym.wrappers.transport import known_delay_periods, transport_config

_EVALUATION_BATCH = 64


def make_training_env(config: TrainConfig, hyperparameters: dict[str, Any]) -> VecNormalize:
    """Return the normalized SB3 face of the batched environment, seeded.

    Raises:
        ParameterError: wrappers or arguments that cannot be used, or seeds kept for validation.
    """
    count = require_whole("n_envs", hyperparameters["n_envs"], 1, LARGEST_BATCH)
    if config.seed + count > VALIDATION_SEED:
        raise ParameterError(
            "seed",
            config.seed,
            f"0 <= seed <= {VALIDATION_SEED - count}",
            "Each episode of the batch has a seed from it on; those above are kept for evaluation.",
        )
    venv = VecNormalize(_sb3_env(config, hyperparameters, count), norm_reward=True)
    venv.gamma = float(hyperparameters.get("gamma", 0.99))
    venv.seed(config.seed)  # episode i with seed + i, as SB3's models do, too
    return venv


def make_evaluation_env(config: TrainConfig, hyperparameters: dict[str, Any]) -> VecNormalize:
    """Return an environment of its own, normalized as the training's is at each evaluation."""
    count = min(config.evaluation_episodes, _EVALUATION_BATCH)
    return VecNormalize(_sb3_env(config, hyperparameters, count), training=False, norm_reward=False)


def _sb3_env(config: TrainConfig, hyperparameters: dict[str, Any], num_envs: int) -> Sb3VecEnv:
    env_id, arguments = config.env_id, hyperparameters.get("env_kwargs") or {}
    try:
        env: gymnasium.vector.VectorEnv[Any, Any, Any] = gymnasium.make_vec(
            f"defmanip_gym:{env_id}",
            num_envs=num_envs,
            num_threads=config.num_threads,
            autoreset_mode=AutoresetMode.SAME_STEP,
            **arguments,
        )
    except DefmanipError:
        raise
    except (TypeError, ValueError, gymnasium.error.Error) as error:
        raise ParameterError(
            "env_kwargs", arguments, f"arguments of {env_id}", f"{error}."
        ) from error
    for wrapper, options in components(hyperparameters, "env_wrapper"):
        env = built("env_wrapper", _batched(wrapper), (env,), options)
    if config.certificate is not None:
        transport = transport_config(env)
        certificate = certify(
            transport.beam,
            sigma_rad=transport.sigma_rad,
            method=config.certificate,
            conditions=TRANSPORT_CONDITIONS,
        )
        env = NuMaxVectorActionScaling(env, certificate)
    if config.filter is not None:
        made = shared_filter(transport_config(env), config.filter, known_delay_periods(env))
        env = SafetyFilterVectorWrapper(env, made)
    return Sb3VecEnv(env)


def _batched(wrapper: Any) -> Any:
    """Return the batched counterpart that a wrapper of single environments names."""
    if isinstance(wrapper, type) and issubclass(wrapper, gymnasium.vector.VectorWrapper):
        return wrapper
    counterpart = getattr(wrapper, "vector_wrapper", None)
    if counterpart is None:
        raise ParameterError(
            "env_wrapper",
            wrapper,
            "a wrapper whose attribute vector_wrapper is its counterpart for batches",
            "Training runs on a batch; rl_zoo3 also takes other wrappers.",
        )
    return counterpart
