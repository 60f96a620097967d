"""Controllers of agents as they were trained: above what they correct, inside their filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.filtered import FilteredController
from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.card import AgentCard
from defmanip_gym.baselines.residual import ResidualController
from defmanip_gym.baselines.residual_base import corrected_controller
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.registration import environment_arguments
from defmanip_gym.errors import AgentFileError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, Certificate, certify
from defmanip_gym.theory.filters.family import require_filter

_CONFIGURED = frozenset(field.name for field in fields(TransportConfig))


def training_config(card: AgentCard) -> TransportConfig:
    """Return the environment that an agent was trained in, as far as it is configured.

    Raises:
        AgentFileError: the card's ``env_kwargs`` are no arguments of it.
    """
    changes: Any = card.hyperparameters.get("env_kwargs") or {}
    if not isinstance(changes, Mapping):
        raise _foreign(changes)
    arguments = environment_arguments(card.env_id) | dict(changes)
    try:
        return TransportConfig(**{name: arguments[name] for name in _CONFIGURED & set(arguments)})
    except (ParameterError, TypeError) as error:
        raise _foreign(changes) from error


def controller_of(actor: MlpActor, *, certificate: Certificate | None = None) -> Controller:
    """Return the controller that an agent stands for, without its filter.

    That is the network itself, or, of a residual agent, the controller below it plus the network's
    correction.

    Args:
        actor: the agent.
        certificate: what the paper's controller under a residual keeps to; by default the one of
            the training, computed anew for the reference beam.

    Raises:
        AgentFileError: a card whose environment or base there is not.
    """
    card = actor.card
    if card.residual_authority_m_s2 is None:
        return actor
    return ResidualController(
        _below(card, certificate),
        actor,
        authority=card.residual_authority_m_s2 / TaskParams().max_acceleration_m_s2,
        decision_periods=card.residual_decision_periods,
    )


def deployed(actor: MlpActor) -> Controller:
    """Return the controller that an agent stands for, inside the filter that it learned in.

    Raises:
        AgentFileError: a card whose environment, base or filter there is not.
    """
    controller, specification = controller_of(actor), actor.card.filter_specification
    if specification is None:
        return controller
    try:
        return FilteredController(controller, require_filter("filter", specification))
    except ParameterError as error:
        raise AgentFileError(
            "filter_specification", specification, "a filter's specification", f"{error}"
        ) from error


def corrected_by(actor: MlpActor) -> Controller | None:
    """Return what an agent corrects inside a filter; None if it corrects nothing there."""
    card = actor.card
    if card.residual_authority_m_s2 is None or card.certificate is not None:
        return None
    return _below(card, None)


def _below(card: AgentCard, certificate: Certificate | None) -> Controller:
    if card.certificate is None:
        try:
            return corrected_controller(card.residual_base, training_config(card))
        except ParameterError as error:
            raise AgentFileError(
                "residual_base", card.residual_base, "a registered controller", f"{error}"
            ) from error
    if certificate is None:
        certificate = certify(
            BeamParams(), method=card.certificate, conditions=TRANSPORT_CONDITIONS
        )
    return TannerController(certificate=certificate, params=GENTLE_PARAMS)


def _foreign(changes: object) -> AgentFileError:
    return AgentFileError(
        "env_kwargs", changes, "arguments of the environment", "The agent's card is foreign."
    )
