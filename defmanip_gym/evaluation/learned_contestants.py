"""Learned contestants: shipped families, and agents of the user's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.agents import is_sb3_zip, load_agent, load_family
from defmanip_gym.baselines.learned.card import AgentCard
from defmanip_gym.baselines.learned.deployment import training_config
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.errors import AgentFileError
from defmanip_gym.evaluation.colours import GUEST_COLOURS, contestant_colour
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM
from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.controllers import Learned, Sb3Zip
from defmanip_gym.evaluation.entry import SOLE_MEMBER
from defmanip_gym.evaluation.options import (
    CERTIFICATES,
    FILTER_OPTION,
    INNER_LOOP_MARK,
    inside,
    known_below,
    known_inside,
)
from defmanip_gym.evaluation.protection import (
    Certificates,
    StorageProtection,
    protection_named,
)
from defmanip_gym.evaluation.rollout import ACTION_SIZE
from defmanip_gym.observation import ObservationLayout

# env_kwargs
_OF_THE_PLANT = frozenset({"beam", "beam_ranges", "robot", "disturbance", "disturbance_ranges"})
# by their colours; what else an agent was trained inside has the last one
_GUEST_OPTIONS = ("", FILTER_OPTION)


def family_contestant(
    name: str, certificates: Certificates, member_limit: int | None
) -> Contestant:
    """Return a shipped family, alone or inside a filter, on either inner loop.

    Args:
        name: family, family@inner_loop, and either of them with /filter.
        certificates: where certificates come from.
        member_limit: how many members take part, lowest seeds first; all by default.

    Raises:
        AgentFileError: an agent cannot be loaded or does not fit the environment.
    """
    base, _, method = name.partition("/")
    family, _, other = base.partition(INNER_LOOP_MARK)
    actors = load_family(family)[:member_limit]
    about = f"Agents of the shipped family {family}, trained with {len(actors)} seeds"
    colour = contestant_colour(base, method)
    inner_loop = cast(InnerLoopKind, other) if other else inner_loop_of_family(family)
    contestant = _learned(name, actors, method, about, colour, certificates, inner_loop)
    if not other:
        return contestant
    description = f"{contestant.description[:-1]}, on the inner loop {other!r}."
    return replace(contestant, description=description)


def inner_loop_of_family(family: str) -> InnerLoopKind:
    """Return the inner loop that a shipped family was trained on."""
    return training_config(load_family(family)[0].card).inner_loop


def agent_contestants(
    path: Path,
    certificates: Certificates,
    *,
    allow_pickle: bool = False,
    normalization: str | None = None,
) -> tuple[Contestant, ...]:
    """Return an agent of the user's: alone, inside the filter, and inside what it learned in.

    Its name ends in a digest of the agent, so that records of another never pass for its own.

    Args:
        path: run folder or file.
        certificates: where its certificate comes from.
        allow_pickle: take SB3's zip files, too, which run whatever code their maker put in.
        normalization: of a zip file, as for ``load_sb3_zip``.

    Raises:
        AgentFileError: the agent cannot be loaded or does not fit the environment.
    """
    if allow_pickle and is_sb3_zip(path):
        return _sb3_contestants(path, certificates, normalization)
    if normalization is not None:
        raise AgentFileError(
            "normalization", normalization, f"nothing with {path}", "It is no zip file of SB3."
        )
    actor = load_agent(path)
    options = dict.fromkeys(("", FILTER_OPTION, actor.card.trained_inside or ""))
    return tuple(_guest(path, actor, option, certificates) for option in options)


def agent_as_trained(path: Path, certificates: Certificates) -> Contestant:
    """Return an agent of the user's, inside the filter that it learned in, if any.

    Raises:
        AgentFileError: the agent cannot be loaded or does not fit the environment.
    """
    actor = load_agent(path)
    return _guest(path, actor, actor.card.safety_filter or "", certificates)


def _guest(path: Path, actor: MlpActor, method: str, certificates: Certificates) -> Contestant:
    folder = path.resolve() if path.is_dir() else path.resolve().parent
    name = f"{folder.name}@{actor.digest}"
    return _learned(
        f"{name}/{method}" if method else name,
        (actor,),
        method,
        f"{actor.card.algorithm} agent made by `{actor.card.command}`",
        GUEST_COLOURS[_GUEST_OPTIONS.index(method) if method in _GUEST_OPTIONS else -1],
        certificates,
        training_config(actor.card).inner_loop,
    )


def _sb3_contestants(
    path: Path, certificates: Certificates, normalization: str | None
) -> tuple[Contestant, Contestant]:
    model = load_sb3_zip(path, normalization)
    spec = Sb3Zip(path.resolve(), model.digest, normalization)
    name = f"{path.stem}@{model.digest}"
    _require_fit(name, model.observation_size, ACTION_SIZE)
    about = f"{model.algorithm.upper()} model of Stable-Baselines3 in {path}"
    plain = Contestant(
        name=name,
        family="learned",
        description=f"{about}.",
        privileged="what its training saw is not known",
        colour=GUEST_COLOURS[0],
        members=(Member(name=SOLE_MEMBER, controller=spec),),
    )
    return plain, replace(
        plain,
        name=f"{name}/{FILTER_OPTION}",
        description=f"{about}{inside(FILTER_OPTION)}.",
        privileged="; ".join((plain.privileged, *known_inside(FILTER_OPTION))),
        colour=GUEST_COLOURS[1],
        protection=StorageProtection(FILTER_OPTION),
    )


def _learned(
    name: str,
    actors: Sequence[MlpActor],
    method: str,
    about: str,
    colour: str,
    certificates: Certificates,
    inner_loop: InnerLoopKind,
) -> Contestant:
    for actor in actors:
        _require_fit(name, actor.card.observation_size, actor.card.action_size)
    protection = protection_named(method, certificates, inner_loop)
    trained_in = actors[0].card.certificate
    is_residual = actors[0].card.residual_authority_m_s2 is not None
    # the paper's controller under a residual keeps to the certificate around it, or the training's
    below = None
    if is_residual and trained_in is not None:
        below = None if protection is None else protection.certificate
        if below is None and trained_in in CERTIFICATES:
            below = certificates.named(trained_in)
    knows = [_seen_in_training(actors[0].card)]
    if is_residual:
        knows.append("the controller under it knows the nominal robot and beam")
    knows += (*known_inside(method), *known_below(inner_loop))
    return Contestant(
        name=name,
        family="learned",
        description=f"{about}{inside(method)}.",
        privileged="; ".join(knows),
        colour=colour,
        members=tuple(
            Member(
                name=str(actor.card.seed),
                controller=Learned(actor, below),
            )
            for actor in actors
        ),
        protection=protection,
        inner_loop=inner_loop,
    )


def _seen_in_training(card: AgentCard) -> str:
    changed = sorted(_OF_THE_PLANT.intersection(card.hyperparameters.get("env_kwargs") or {}))
    other = f" with another {', '.join(changed)}" if changed else ""
    return f"its training saw the plant of {card.env_id}{other}"


def _require_fit(name: str, observation_size: int, action_size: int) -> None:
    """Raise AgentFileError unless an agent takes the suites' observations and gives an action."""
    layout = ObservationLayout(NOMINAL_BEAM.segment_count)
    sizes = observation_size, action_size
    if sizes != (layout.size, ACTION_SIZE):
        raise AgentFileError(
            f"observation and action size of {name}",
            sizes,
            f"{(layout.size, ACTION_SIZE)}, those of the suites' environment",
            f"Use an agent for a beam of {NOMINAL_BEAM.segment_count} segment in task mode.",
        )
