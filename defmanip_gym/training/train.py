"""The training loop: environment, SB3 model, periodic evaluation, checkpoints, export."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import CallbackList, EvalCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.noise import NormalActionNoise, VectorizedActionNoise
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.baselines.learned.actor import AgentCard
from defmanip_gym.baselines.learned.agents import RUN_AGENT
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import RunFolderError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.training.callbacks import Periodically
from defmanip_gym.training.checkpoint import (
    observation_statistics,
    read_checkpoint,
    write_checkpoint,
)
from defmanip_gym.training.config import TrainConfig, checked_hyperparameters, load_hyperparameters
from defmanip_gym.training.export import hidden_activation, to_actor
from defmanip_gym.training.run_folder import RunFolder
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

_ALGORITHMS: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC, "td3": TD3}

# Seeds of the evaluations during training: neither training's nor the comparison's.
_VALIDATION_SEED = 900_000


def train(config: TrainConfig) -> Path:
    """Train, or go on training, and return the run folder.

    Ctrl-C saves a checkpoint and exits with 130 after saying how to go on.

    Raises:
        ParameterError: hyperparameters that cannot be used.
        RunFolderError: a folder that cannot be written or resumed.
    """
    config, hyperparameters, folder = _prepare(config)
    torch.set_num_threads(1)  # physics uses the other cores
    venv = make_training_env(config, int(hyperparameters["n_envs"]))
    model = build_model(config, hyperparameters, venv)
    if config.resume is not None:
        read_checkpoint(folder.last_checkpoint(), model, venv)
        # other starts than those of the part before
        venv.seed((config.seed * 1000 + model.num_timesteps) % _VALIDATION_SEED)
    total = config.total_timesteps or int(hyperparameters["n_timesteps"])
    if model.num_timesteps >= total:
        venv.close()
        return folder.path
    # a part of its own for every start of the run: SB3's writers begin their files anew
    curves = str(folder.path / "curves" / f"from-{model.num_timesteps:010d}")
    model.set_logger(configure(curves, ["csv", "tensorboard"]))

    def save() -> None:
        folder.save_checkpoint(
            model.num_timesteps, lambda path: write_checkpoint(path, model, venv)
        )
        export(folder, RUN_AGENT, config, model, venv)

    interval = max(1, total // config.evaluations)
    evaluation = EvalCallback(
        _evaluation_env(config, venv),
        n_eval_episodes=config.evaluation_episodes,
        eval_freq=max(1, interval // venv.num_envs),
        log_path=curves,
        verbose=0,
        warn=False,
    )
    try:
        model.learn(
            total - model.num_timesteps,
            callback=CallbackList([evaluation, Periodically(save, interval)]),
            reset_num_timesteps=False,
            progress_bar=True,
        )
    except KeyboardInterrupt:
        save()
        print(
            f"Stopped at {model.num_timesteps} steps. Go on with: "
            f"python train.py --resume {folder.path}"
        )
        raise SystemExit(130) from None
    finally:
        venv.close()
    save()
    return folder.path


def make_training_env(config: TrainConfig, num_envs: int) -> VecNormalize:
    """Return the normalized SB3 face of the batched environment, seeded."""
    venv = VecNormalize(_sb3_env(config, num_envs), norm_reward=True)
    # a seed of its own for every episode generator of every run
    venv.seed(config.seed * 1000 % _VALIDATION_SEED)
    return venv


def build_model(
    config: TrainConfig, hyperparameters: dict[str, Any], venv: VecNormalize
) -> BaseAlgorithm:
    """Return an untrained model from rl-zoo3 hyperparameters."""
    arguments = {
        key: value
        for key, value in hyperparameters.items()
        if key not in ("n_envs", "n_timesteps", "normalize", "noise_type", "noise_std")
    }
    venv.gamma = float(arguments.get("gamma", 0.99))
    if hyperparameters.get("noise_type") == "normal":
        size = venv.action_space.shape[0]  # type: ignore[index]
        deviation = float(hyperparameters["noise_std"]) * np.ones(size)
        noise = NormalActionNoise(np.zeros(size), deviation)
        arguments["action_noise"] = VectorizedActionNoise(noise, venv.num_envs)
    arguments["learning_rate"] = _schedule(arguments["learning_rate"])
    policy = arguments.pop("policy")
    return _ALGORITHMS[config.algo](
        policy, venv, seed=config.seed, device="cpu", verbose=0, **arguments
    )


def _schedule(rate: float | str) -> float | LinearSchedule:
    """Return a learning rate, or rl-zoo3's ``lin_x``: from x down to zero over the run."""
    if isinstance(rate, str) and rate.startswith("lin_"):
        return LinearSchedule(float(rate.removeprefix("lin_")), 0.0, 1.0)
    return float(rate)


def export(
    folder: RunFolder, name: str, config: TrainConfig, model: BaseAlgorithm, venv: VecNormalize
) -> None:
    """Write the model's policy as a portable agent into the run folder."""
    started = folder.read_config()  # as it was when the run began, not now
    card = AgentCard(
        env_id=ENV_ID,
        observation_size=int(np.prod(venv.observation_space.shape or ())),
        action_size=int(np.prod(venv.action_space.shape or ())),
        algorithm=config.algo,
        activation=hidden_activation(model),  # type: ignore[arg-type]
        squashed=config.algo != "ppo",
        command=started["command"],
        seed=config.seed,
        total_timesteps=model.num_timesteps,
        package_version=started["package_version"],
        git_revision=started["git_revision"],
        certificate=config.certificate,
    )
    to_actor(model, card, observation_statistics(venv)).save(folder.path / name)


def _prepare(config: TrainConfig) -> tuple[TrainConfig, dict[str, Any], RunFolder]:
    """Return configuration, hyperparameters and folder of a new or resumed run."""
    if config.resume is None:
        hyperparameters = load_hyperparameters(config.hyperparameters, config.algo)
        folder = RunFolder.create(config, hyperparameters, "python " + " ".join(sys.argv))
        return config, hyperparameters, folder
    folder = RunFolder(config.resume)
    stored = folder.read_config()
    fields = {
        **stored["train"],
        "resume": config.resume,
        "output": Path(stored["train"]["output"]),
        "hyperparameters": None,
    }
    if config.total_timesteps is not None:
        fields["total_timesteps"] = config.total_timesteps
    try:
        return (
            replace(TrainConfig(), **fields),
            checked_hyperparameters(stored["hyperparameters"], str(folder.path)),
            folder,
        )
    except (TypeError, KeyError) as error:
        raise RunFolderError(
            "resume", str(folder.path), "a run of this version", f"config.json: {error}"
        ) from error


def _evaluation_env(config: TrainConfig, venv: VecNormalize) -> VecNormalize:
    """Return an environment of its own, normalized as the training's is at each evaluation."""
    count = min(config.evaluation_episodes, 32)
    env = VecNormalize(_sb3_env(config, count), training=False, norm_reward=False)
    env.seed(_VALIDATION_SEED)
    return env


def _sb3_env(config: TrainConfig, num_envs: int) -> Sb3VecEnv:
    env: gymnasium.vector.VectorEnv[Any, Any, Any] = gymnasium.make_vec(
        f"defmanip_gym:{ENV_ID}", num_envs=num_envs
    )
    if config.certificate is not None:
        certificate = certify(
            BeamParams(), method=config.certificate, conditions=TRANSPORT_CONDITIONS
        )
        env = NuMaxVectorActionScaling(env, certificate)
    return Sb3VecEnv(env)
