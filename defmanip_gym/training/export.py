"""From an SB3 model to a portable actor."""

from __future__ import annotations

from dataclasses import dataclass
from inspect import signature
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.card import AgentCard
from defmanip_gym.baselines.residual_action import ResidualAction
from defmanip_gym.baselines.residual_base import certified_authority, filter_authority
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.state import wrappers
from defmanip_gym.errors import AgentFileError
from defmanip_gym.params import BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.training.hyperparameters import components
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

_ACTIVATION_NAMES = {nn.Tanh: "tanh", nn.ReLU: "relu"}


def actor_modules(model: BaseAlgorithm) -> tuple[list[nn.Module], bool]:
    """Return the layers of a model's deterministic actor and whether tanh squashes its output.

    Raises:
        AgentFileError: an algorithm other than PPO, SAC, TQC and TD3.
    """
    policy: Any = model.policy
    name = type(model).__name__
    if name == "PPO":
        return [*policy.mlp_extractor.policy_net, policy.action_net], False
    if name in ("SAC", "TQC"):
        return [*policy.actor.latent_pi, policy.actor.mu], True
    if name == "TD3":
        return [*policy.actor.mu][:-1], True
    raise AgentFileError(
        "algorithm", name, "PPO, SAC, TQC or TD3", "Export knows these actors only."
    )


def hidden_activation(model: BaseAlgorithm) -> str:
    """Return the name of the hidden layers' activation.

    Raises:
        AgentFileError: neither tanh nor ReLU.
    """
    modules, _ = actor_modules(model)
    kinds = {type(module) for module in modules} - {nn.Linear}
    names = {_ACTIVATION_NAMES.get(kind, kind.__name__) for kind in kinds}
    if len(names) != 1 or not names <= set(_ACTIVATION_NAMES.values()):
        raise AgentFileError("activation", sorted(names), "tanh or relu", "Train with one of them.")
    return names.pop()


@dataclass(frozen=True, kw_only=True)
class Residual:
    """How a residual policy acts, for its card."""

    base: str
    inside: str
    authority_m_s2: float
    decision_periods: int

    @property
    def certificate(self) -> str | None:
        """The certificate that it stays inside, if it is one."""
        return None if self.inside in STORAGE_FILTERS else self.inside


def residual_of(hyperparameters: dict[str, Any]) -> Residual | None:
    """Return how a residual policy acts, None for another."""
    for wrapper, options in components(hyperparameters, "env_wrapper"):
        if wrapper is ResidualAction:
            settings = signature(ResidualAction).bind(None, **options)
            settings.apply_defaults()
            inside, wished = settings.arguments["inside"], settings.arguments["authority"]
            if inside in STORAGE_FILTERS:
                share = filter_authority(wished)
            else:
                bound = certify(BeamParams(), method=inside, conditions=TRANSPORT_CONDITIONS)
                share = certified_authority(bound, TransportConfig(), wished)
            return Residual(
                base=settings.arguments["base"],
                inside=inside,
                authority_m_s2=share * TaskParams().max_acceleration_m_s2,
                decision_periods=settings.arguments["decision_periods"],
            )
    return None


def filter_around(venv: VecNormalize) -> dict[str, Any] | None:
    """Return the specification of the safety filter around a training's batch, None without one.

    Certificates are told by their names instead.
    """
    batch: Any = venv.venv  # an Sb3VecEnv
    for layer in wrappers(batch.env):
        if isinstance(layer, SafetyFilterVectorWrapper):
            specification = layer.filtering.specification
            if specification["name"] in STORAGE_FILTERS:
                return specification
    return None


def to_actor(model: BaseAlgorithm, card: AgentCard, normalization: RunningMeanStd) -> MlpActor:
    """Return the model's deterministic policy with its observation normalization."""
    modules, _ = actor_modules(model)
    linear = [module for module in modules if isinstance(module, nn.Linear)]
    return MlpActor(
        card,
        weights=[layer.weight.detach().double().numpy().copy() for layer in linear],
        biases=[layer.bias.detach().double().numpy().copy() for layer in linear],
        observation_mean=normalization.mean.copy(),
        observation_variance=normalization.var.copy(),
    )
