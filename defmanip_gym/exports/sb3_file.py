"""An actor as SB3's own model, saved by SB3: its pickles are written here, and none is read."""

from __future__ import annotations

import io
import pickle
from pathlib import Path

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.errors import AgentFileError
from defmanip_gym.files import write_atomically
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.environments import make_training_env
from defmanip_gym.training.export import actor_modules, hidden_activation
from defmanip_gym.training.hyperparameters import checked_hyperparameters
from defmanip_gym.training.learner_state import observation_statistics
from defmanip_gym.training.model import build_model


def normalization_path(path: Path) -> Path:
    """Return where the statistics of a zip file lie, as ``load_sb3_zip`` finds them."""
    return path.with_name(f"{path.stem}_vecnormalize.pkl")


def write_sb3(path: Path, actor: MlpActor) -> None:
    """Write a model of the agent's algorithm and hyperparameters, and its ``VecNormalize``.

    Its actor is the agent. Critics, value function, exploration and the statistics of rewards are
    as at the beginning of a training, since agents do not keep them.

    Args:
        path: of the zip file.
        actor: a controller of its own, no residual.

    Raises:
        AgentFileError: the card's hyperparameters make another network.
        ParameterError: they make none.
    """
    card = actor.card
    hyperparameters = checked_hyperparameters(dict(card.hyperparameters), "the agent's card")
    # no filter or certificate, as what it was trained inside changes neither space nor network
    config = TrainConfig(algo=card.recipe, env=card.env_id, seed=card.seed)  # type: ignore[arg-type]
    venv = make_training_env(config, hyperparameters)
    try:
        model = build_model(card.recipe, card.seed, hyperparameters, venv)
        _set_actor(model, actor)
        _set_normalization(venv, actor)
        model.num_timesteps = card.total_timesteps
        content = io.BytesIO()
        model.save(content)
        # first, as the zip file alone would act on observations as they are
        write_atomically(normalization_path(path), pickle.dumps(venv))
        write_atomically(path, content.getvalue())
    finally:
        venv.close()


def _set_actor(model: BaseAlgorithm, actor: MlpActor) -> None:
    modules, _ = actor_modules(model)
    linear = [module for module in modules if isinstance(module, nn.Linear)]
    made = hidden_activation(model), [tuple(layer.weight.shape) for layer in linear]
    kept = actor.card.activation, [weight.shape for weight, _ in actor.layers]
    if made != kept:
        raise AgentFileError(
            "layers of the agent", kept, f"{made}, as its card's hyperparameters say", "Damaged?"
        )
    with torch.no_grad():
        for layer, (weight, bias) in zip(linear, actor.layers, strict=True):
            layer.weight.copy_(torch.from_numpy(weight))
            layer.bias.copy_(torch.from_numpy(bias))


def _set_normalization(venv: VecNormalize, actor: MlpActor) -> None:
    venv.clip_obs = actor.card.normalization.clip
    venv.epsilon = actor.card.normalization.variance_floor
    statistics = observation_statistics(venv)
    statistics.mean = actor.observation_mean.copy()
    statistics.var = actor.observation_variance.copy()
    statistics.count = float(actor.card.total_timesteps)
