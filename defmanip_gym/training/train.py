"""The training loop: environment, SB3 model, periodic evaluation, checkpoints, export."""

from __future__ import annotations

import shlex
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import CallbackList
from stable_baselines3.common.logger import Logger, make_output_format
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.baselines.learned.agents import RUN_AGENT
from defmanip_gym.baselines.learned.card import AgentCard, Normalization
from defmanip_gym.baselines.residual_base import PAPERS
from defmanip_gym.errors import RunFolderError
from defmanip_gym.training.callbacks import Checkpoints, progress_bar, stop_on_ctrl_c
from defmanip_gym.training.checkpoint import planned_timesteps, read_checkpoint, write_checkpoint
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.environments import make_evaluation_env, make_training_env
from defmanip_gym.training.export import (
    actor_modules,
    filter_around,
    hidden_activation,
    residual_of,
    to_actor,
)
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.learner_state import observation_statistics
from defmanip_gym.training.model import build_model, callbacks_of
from defmanip_gym.training.run_folder import LAST_AGENT, RunFolder
from defmanip_gym.training.sources import sources_digest
from defmanip_gym.training.validation_callback import ValidationCallback
from defmanip_gym.version import __version__

_NOT_OF_THE_RUN = ("algo", "seed", "output", "num_threads", "resume")  # two are told anyway


def train(config: TrainConfig, *, shows_progress: bool = True) -> Path:
    """Train, or go on training, and return the run folder.

    Ctrl-C saves a checkpoint before the next rollout and exits with 130 after saying how to go on;
    a second one, and a ``KeyboardInterrupt`` from elsewhere, exit at once.

    Args:
        config: what to train.
        shows_progress: whether a bar tells how far it is.

    Raises:
        ParameterError: hyperparameters that cannot be used.
        RunFolderError: a folder that cannot be written or resumed.
    """
    config, hyperparameters = _prepare(config)
    torch.set_num_threads(1)  # physics uses the other cores
    venv = make_training_env(config, hyperparameters)
    model = build_model(config.algo, config.seed, hyperparameters, venv)
    model.set_logger(Logger(None, []))  # its files follow once it is known where the run stands
    total = config.total_timesteps or int(hyperparameters["n_timesteps"])
    interval = max(1, total // config.evaluations)
    evaluation = make_evaluation_env(config, hyperparameters)
    callbacks = callbacks_of(hyperparameters)
    # only now: a folder of what cannot be trained would look like a run
    folder = _folder(config, hyperparameters)
    callbacks.append(
        ValidationCallback(
            evaluation,
            episodes=config.evaluation_episodes,
            interval=interval // venv.num_envs,
            on_best=lambda: export(folder, RUN_AGENT, config, model, venv),
        )
    )
    if config.resume is not None:
        read_checkpoint(folder.last_checkpoint(), model, venv, callbacks)
    if model.num_timesteps >= total:
        venv.close()
        return folder.path
    _begin_curves(model.logger, folder, model.num_timesteps)

    def save() -> None:
        folder.save_checkpoint(
            model.num_timesteps,
            lambda path: write_checkpoint(path, model, venv, callbacks, total),
        )
        export(folder, LAST_AGENT, config, model, venv)

    try:
        with folder.held(), stop_on_ctrl_c() as stop, progress_bar(shows_progress) as bars:
            model.learn(
                total - model.num_timesteps,
                callback=CallbackList([*callbacks, Checkpoints(save, interval, stop), *bars]),
                reset_num_timesteps=False,
            )
            save()
    except KeyboardInterrupt:
        print(f"Stopped at {model.num_timesteps} steps. {_how_to_go_on(folder)}")
        raise SystemExit(130) from None
    finally:
        venv.close()
    return folder.path


def _begin_curves(logger: Logger, folder: RunFolder, timesteps: int) -> None:
    """Let a logger write a part of its own for every start of a run: its files begin anew."""
    part = str(folder.path / "curves" / f"from-{timesteps:010d}")
    logger.dir = part
    logger.output_formats = [make_output_format(kind, part) for kind in ("csv", "tensorboard")]


def _how_to_go_on(folder: RunFolder) -> str:
    try:
        checkpoint = folder.last_checkpoint()
    except RunFolderError:
        return "There is no checkpoint yet: start the run anew."
    return f"Go on from {checkpoint.name} with: python train.py --resume {folder.path}"


def export(
    folder: RunFolder, name: str, config: TrainConfig, model: BaseAlgorithm, venv: VecNormalize
) -> None:
    """Write the model's policy as a portable agent into the run folder."""
    started = folder.read_config()  # as it was when the run began, not now
    hyperparameters = started.hyperparameters
    residual = residual_of(hyperparameters)
    specification = filter_around(venv)
    card = AgentCard(
        env_id=config.env_id,
        observation_size=int(np.prod(venv.observation_space.shape or ())),
        action_size=int(np.prod(venv.action_space.shape or ())),
        algorithm=type(model).__name__.lower(),
        recipe=config.algo,
        hyperparameters=hyperparameters,
        activation=hidden_activation(model),  # type: ignore[arg-type]
        squashed=actor_modules(model)[1],
        normalization=Normalization(clip=venv.clip_obs, variance_floor=venv.epsilon),
        residual_authority_m_s2=residual.authority_m_s2 if residual else None,
        residual_decision_periods=residual.decision_periods if residual else 1,
        residual_base=residual.base if residual else PAPERS,
        command=started.command,
        seed=config.seed,
        total_timesteps=model.num_timesteps,
        package_version=started.package_version,
        git_revision=started.git_revision,
        sources=started.sources,
        certificate=residual.certificate if residual else config.certificate,
        safety_filter=specification["name"] if specification else None,
        filter_specification=specification,
    )
    to_actor(model, card, observation_statistics(venv)).save(folder.path / name)


def _prepare(config: TrainConfig) -> tuple[TrainConfig, dict[str, Any]]:
    """Return configuration and hyperparameters of a new or resumed run."""
    if config.resume is None:
        return config, load_hyperparameters(config.hyperparameters, config.algo, config.env_id)
    stored = RunFolder(config.resume).read_config()
    if stored.package_version != __version__:
        raise RunFolderError(
            f"version of {config.resume}",
            stored.package_version,
            f"{__version__}, as installed",
            "Environment or reward may differ: install the run's version, or train anew.",
        )
    if stored.sources != sources_digest():
        raise RunFolderError(
            f"sources of {config.resume}",
            stored.sources,
            f"{sources_digest()}, as they are now",
            f"Go on with those of revision {stored.git_revision}, or train anew: an agent of two "
            "kinds of training would be neither's.",
        )
    total = config.total_timesteps or planned_timesteps(RunFolder(config.resume).last_checkpoint())
    return (
        replace(stored.train, resume=config.resume, total_timesteps=total),
        stored.hyperparameters,
    )


def _folder(config: TrainConfig, hyperparameters: dict[str, Any]) -> RunFolder:
    """Return the folder of a resumed run, or make one."""
    if config.resume is not None:
        return RunFolder(config.resume)
    return RunFolder.create(config, hyperparameters, command_of(config))


def command_of(config: TrainConfig) -> str:
    """Return the command that makes a run, whatever began it: what changes nothing is left out."""
    words = ["python", "train.py", "--algo", config.algo]
    for field in fields(TrainConfig):
        value = getattr(config, field.name)
        if field.name not in _NOT_OF_THE_RUN and value != field.default:
            words += [f"--{field.name.replace('_', '-')}", str(value)]
    return shlex.join([*words, "--seed", str(config.seed)])
