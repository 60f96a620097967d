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
from defmanip_gym.baselines.residual_base import PAPERS, corrected_controller
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.registration import environment_arguments
from defmanip_gym.errors import AgentFileError, InvalidValueError, ParameterError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, BeamRanges
from defmanip_gym.payloads.choice import payload_of
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, Certificate, certify
from defmanip_gym.theory.filters.family import require_filter
from defmanip_gym.theory.filters.safety_filter import SafetyFilter

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
    given = {name: arguments[name] for name in _CONFIGURED & set(arguments)}
    try:
        given["payload"] = payload_of(
            arguments.get("payload"),
            beam=arguments.get("beam", BeamParams()),
            beam_ranges=arguments.get("beam_ranges", BeamRanges()),
            nominal_beam=arguments.get("nominal_beam"),
        )
        return TransportConfig(**given)
    except (InvalidValueError, TypeError) as error:
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
        AgentFileError: a card whose environment or base there is not, or whose corrections are
            larger or held longer than any.
    """
    card = actor.card
    if card.residual_authority_m_s2 is None:
        return actor
    below = _below(card, certificate)
    try:
        return ResidualController(
            below,
            actor,
            authority=card.residual_authority_m_s2 / TaskParams().max_acceleration_m_s2,
            decision_periods=card.residual_decision_periods,
        )
    except ParameterError as error:
        raise AgentFileError(
            "residual",
            (card.residual_authority_m_s2, card.residual_decision_periods),
            "corrections as trainings make them",
            f"{error}",
        ) from error


def deployed(actor: MlpActor) -> Controller:
    """Return the controller that an agent stands for, inside the filter that it learned in.

    Raises:
        AgentFileError: a card whose environment, base or filter there is not, or that does not
            tell all of its filter.
    """
    controller, safety_filter = controller_of(actor), filter_of(actor.card)
    return controller if safety_filter is None else FilteredController(controller, safety_filter)


def filter_of(card: AgentCard) -> SafetyFilter | None:
    """Return the safety filter that an agent learned in, None if it did in none.

    Raises:
        AgentFileError: there is no such filter, or not for its observations.
    """
    specification = card.filter_specification
    if specification is None:
        if card.safety_filter is None:
            return None
        raise _no_filter(specification, "The card is an old one: train the agent again.")
    try:
        made = require_filter("filter", specification)
    except InvalidValueError as error:
        raise _no_filter(specification, f"{error}") from error
    if ObservationLayout(made.segment_count).size != card.observation_size:
        raise _no_filter(specification, f"The agent has {card.observation_size} observations.")
    return made


def corrected_by(actor: MlpActor) -> Controller | None:
    """Return what an agent corrects inside a filter; None if it corrects nothing there."""
    card = actor.card
    if card.residual_authority_m_s2 is None or card.certificate is not None:
        return None
    return _below(card, None)


def _below(card: AgentCard, certificate: Certificate | None) -> Controller:
    if card.certificate is None:
        config = training_config(card)
        try:
            return corrected_controller(card.residual_base, config)
        except InvalidValueError as error:
            raise AgentFileError(
                "residual_base", card.residual_base, "a registered controller", f"{error}"
            ) from error
    if card.residual_base != PAPERS:
        raise AgentFileError(
            "residual_base", card.residual_base, repr(PAPERS), "Others are inside a filter."
        )
    if certificate is None:
        certificate = certify(
            BeamParams(), method=card.certificate, conditions=TRANSPORT_CONDITIONS
        )
    return TannerController(certificate=certificate, params=GENTLE_PARAMS)


def _no_filter(specification: object, remedy: str) -> AgentFileError:
    return AgentFileError(
        "filter_specification", specification, "a filter's, for the agent's beam", remedy
    )


def _foreign(changes: object) -> AgentFileError:
    return AgentFileError(
        "env_kwargs", changes, "arguments of the environment", "The agent's card is foreign."
    )
