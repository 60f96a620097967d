"""Who takes part in a comparison, what each knows, and inside which safety filter each runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.agents import (
    is_sb3_zip,
    load_agent,
    load_family,
    shipped_families,
)
from defmanip_gym.baselines.learned.card import AgentCard
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.errors import AgentFileError
from defmanip_gym.evaluation.colours import GUEST_COLOURS, family_colours
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM
from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.controllers import (
    Learned,
    Random,
    Sb3Zip,
    Tanner,
    Zero,
)
from defmanip_gym.evaluation.entry import SOLE_MEMBER
from defmanip_gym.evaluation.protection import (
    Certificates,
    StorageProtection,
    protection_named,
)
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import DESIGN_DAMPING
from defmanip_gym.theory.filters.family import REFERENCE_FILTERS, STORAGE_FILTERS
from defmanip_gym.validation import require_choice

# The filter that every controller gets; the paper's controller shows what its own idea costs.
FILTER_OPTION = "storage"
_ANALYTIC = (
    "tanner",
    *(f"tanner/{method}" for method in STORAGE_FILTERS),
    "tanner/phase_plane",
    "tanner/l1",
    "tanner/tanner",
)
_CERTIFICATES = ("phase_plane", "l1", "tanner")
_OPTIONS = (*STORAGE_FILTERS, *REFERENCE_FILTERS, *_CERTIFICATES)
_ACTION_SIZE = 3
_OF_THE_PLANT = frozenset({"beam", "beam_ranges", "robot", "disturbance"})  # env_kwargs
_WRAPPER_KNOWS = "the filter knows the nominal beam"
_FILTER_KNOWS = f"{_WRAPPER_KNOWS}, how far others may differ, and noise and delay"


def standard_names() -> tuple[str, ...]:
    """Return the names of the contestants of the standard comparison, in order."""
    return ("zero", "random", *_ANALYTIC, *(n for f in shipped_families() for n in _shown(f)))


def _shown(family: str) -> tuple[str, ...]:
    """Return a family's names: alone, inside the filter, inside what it learned in."""
    trained_in = load_family(family)[0].card.trained_inside
    options = (
        (FILTER_OPTION,) if trained_in in (None, FILTER_OPTION) else (FILTER_OPTION, trained_in)
    )
    return (family, *(f"{family}/{option}" for option in options))


def known_names() -> tuple[str, ...]:
    """Return the names of all contestants that can be asked for, the standard ones first."""
    every = (f"{base}/{option}" for base in ("tanner", *shipped_families()) for option in _OPTIONS)
    return tuple(dict.fromkeys((*standard_names(), *every)))


def standard_contestants(
    names: Sequence[str], certificates: Certificates, member_limit: int | None = None
) -> tuple[Contestant, ...]:
    """Return contestants in the order of ``known_names``.

    Args:
        names: of those wanted.
        certificates: where theirs come from; no others are made.
        member_limit: how many members of a learned contestant take part, lowest seeds first; all
            by default.

    Raises:
        ParameterError: an unknown name.
        AgentFileError: an agent cannot be loaded or does not fit the environment.
    """
    known = known_names()
    for name in names:
        require_choice("contestants", name, known)
    return tuple(
        _standard(name, certificates, member_limit) for name in known if name in set(names)
    )


def agent_contestants(
    path: Path,
    certificates: Certificates,
    *,
    allow_pickle: bool = False,
    normalization: str | None = None,
) -> tuple[Contestant, Contestant]:
    """Return an agent of the user's, without and with the safety filter.

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
    folder = path.resolve() if path.is_dir() else path.resolve().parent
    name = f"{folder.name}@{actor.digest}"
    about = f"{actor.card.algorithm} agent made by `{actor.card.command}`"
    plain = _learned(name, (actor,), None, about, GUEST_COLOURS[0], certificates)
    option = f"{name}/{FILTER_OPTION}"
    return plain, _learned(option, (actor,), FILTER_OPTION, about, GUEST_COLOURS[1], certificates)


def _sb3_contestants(
    path: Path, certificates: Certificates, normalization: str | None
) -> tuple[Contestant, Contestant]:
    model = load_sb3_zip(path, normalization)
    spec = Sb3Zip(path.resolve(), model.digest, normalization)
    name = f"{path.stem}@{model.digest}"
    _require_fit(name, model.observation_size, _ACTION_SIZE)
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
        description=f"{about}, inside the {FILTER_OPTION} filter.",
        privileged=f"{plain.privileged}; {_FILTER_KNOWS}",
        colour=GUEST_COLOURS[1],
        protection=StorageProtection(FILTER_OPTION),
    )


def _standard(name: str, certificates: Certificates, member_limit: int | None) -> Contestant:
    base, _, method = name.partition("/")
    if base in ("zero", "random"):
        return _REFERENCES[base]
    if base == "tanner":
        return _tanner(name, method, certificates)
    actors = load_family(base)[:member_limit]
    about = f"Agents of the shipped family {base}, trained with {len(actors)} seeds"
    colour = family_colours(base)[1 + (method in _CERTIFICATES) if method else 0]
    return _learned(name, actors, method or None, about, colour, certificates)


def _tanner(name: str, method: str, certificates: Certificates) -> Contestant:
    protection = protection_named(method, certificates)
    certificate = None if protection is None else protection.certificate
    description, privileged, colour = _TANNER[method]
    if certificate is not None:
        description += f": grasp acceleration within {certificate.acceleration_bound:.2g} m/s²"
    return Contestant(
        name=name,
        family="analytic",
        description=f"{description}.",
        privileged=privileged,
        colour=colour,
        members=(Member(name=SOLE_MEMBER, controller=Tanner(certificate)),),
        protection=protection,
    )


def _learned(
    name: str,
    actors: Sequence[MlpActor],
    method: str | None,
    about: str,
    colour: str,
    certificates: Certificates,
) -> Contestant:
    for actor in actors:
        _require_fit(name, actor.card.observation_size, actor.card.action_size)
    protection = protection_named(method or "", certificates)
    trained_in = actors[0].card.certificate
    is_residual = actors[0].card.residual_authority_m_s2 is not None
    # outside of a certificate the paper's controller under a residual still is the training's
    below = None if protection is None else protection.certificate
    if below is None and trained_in in _CERTIFICATES:
        below = certificates.named(trained_in)
    knows = [_seen_in_training(actors[0].card)]
    if is_residual:
        knows.append("the controller under it knows the nominal robot and beam")
    if protection is not None:
        is_certificate = protection.certificate is not None
        about += f", inside the {method} {'certificate' if is_certificate else 'filter'}"
        knows.append(_WRAPPER_KNOWS if is_certificate else _FILTER_KNOWS)
    return Contestant(
        name=name,
        family="learned",
        description=f"{about}.",
        privileged="; ".join(knows),
        colour=colour,
        members=tuple(
            Member(
                name=str(actor.card.seed),
                controller=Learned(actor, below if is_residual else None),
            )
            for actor in actors
        ),
        protection=protection,
    )


def _seen_in_training(card: AgentCard) -> str:
    changed = sorted(_OF_THE_PLANT.intersection(card.hyperparameters.get("env_kwargs") or {}))
    other = f" with another {', '.join(changed)}" if changed else ""
    return f"its training saw the plant of {card.env_id}{other}"


def _require_fit(name: str, observation_size: int, action_size: int) -> None:
    """Raise AgentFileError unless an agent takes the suites' observations and gives an action."""
    layout = ObservationLayout(NOMINAL_BEAM.segment_count)
    sizes = observation_size, action_size
    if sizes != (layout.size, _ACTION_SIZE):
        raise AgentFileError(
            f"observation and action size of {name}",
            sizes,
            f"{(layout.size, _ACTION_SIZE)}, those of the suites' environment",
            f"Use an agent for a beam of {NOMINAL_BEAM.segment_count} segment in task mode.",
        )


_REFERENCES = {
    "zero": Contestant(
        name="zero",
        family="reference",
        description="Asks for no acceleration; only disturbances move it.",
        privileged="nothing",
        colour="#8c8c8c",
        members=(Member(name=SOLE_MEMBER, controller=Zero()),),
    ),
    "random": Contestant(
        name="random",
        family="reference",
        description="Draws uniform actions.",
        privileged="nothing",
        colour="#b08968",
        members=(Member(name=SOLE_MEMBER, controller=Random()),),
    ),
}

# by certificate: description, what it knows, colour
_NOMINAL_MODEL = "nominal robot and beam"
_TANNER = {
    "": ("The paper's controller without certificate", _NOMINAL_MODEL, "#45b5aa"),
    "storage": (
        "The paper's controller inside the storage filter: Lemma III.1's V kept below V_σ",
        f"{_NOMINAL_MODEL}; {_FILTER_KNOWS}",
        "#12806a",
    ),
    "backup": (
        "The paper's controller inside the backup filter: what a rollout shows to be safe",
        f"{_NOMINAL_MODEL}; {_FILTER_KNOWS}",
        "#5a6e2e",
    ),
    "cbf_qp": (
        "The paper's controller inside the literature's filter: a barrier by quadratic program",
        f"{_NOMINAL_MODEL}; {_FILTER_KNOWS}",
        "#8a5a9e",
    ),
    "phase_plane": (
        "The paper's controller under the largest bound that the nonlinear nominal beam allows",
        _NOMINAL_MODEL,
        "#1b3a6b",
    ),
    "l1": (
        "The paper's controller under the exact bound of the linear model of the nominal beam",
        _NOMINAL_MODEL,
        "#2f7fc1",
    ),
    "tanner": (
        "The paper's controller under the paper's own bound, Eq. (18), for its design damping of "
        f"{DESIGN_DAMPING:g} N·m·s/rad (not proven for less)",
        f"{_NOMINAL_MODEL}; a damping that is not the plant's",
        "#8fa6c9",
    ),
}
