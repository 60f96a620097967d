"""Who takes part in a comparison, what each knows, and inside which safety filter each runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from defmanip_gym.baselines.factories import is_reference
from defmanip_gym.baselines.learned.agents import load_family, shipped_families
from defmanip_gym.baselines.registrations import REFERENCES, registrations
from defmanip_gym.baselines.registry import available_controllers, named, registered_controllers
from defmanip_gym.errors import ControllerError, InstallationError
from defmanip_gym.evaluation.analytic_contestants import controller_contestant
from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.controllers import Random, Zero
from defmanip_gym.evaluation.entry import SOLE_MEMBER
from defmanip_gym.evaluation.learned_contestants import family_contestant, inner_loop_of_family
from defmanip_gym.evaluation.options import (
    CERTIFICATES,
    FILTER_OPTION,
    INNER_LOOP_MARK,
    OPTIONS,
    OTHER_INNER_LOOP,
)
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.validation import require_choice

# the paper's controller shows what its own idea costs, and inside which others it could run
_PAPERS = "tanner"
_PAPERS_OPTIONS = (*STORAGE_FILTERS, *CERTIFICATES)


def standard_names() -> tuple[str, ...]:
    """Return the names of the contestants of the standard comparison, in order.

    Controllers that cannot be made here are left out; asked for, they say why.
    """
    return standard_names_with(available_controllers())


def standard_names_with(controllers: Iterable[str]) -> tuple[str, ...]:
    """Return what the standard comparison is with these of the registered controllers."""
    analytic = (n for name in controllers for n in _shown_controller(name))
    return (*REFERENCES, *analytic, *(n for f in shipped_families() for n in _shown(f)))


def _shown_controller(name: str) -> tuple[str, ...]:
    """Return a controller's names: alone and inside the filter; the paper's inside more."""
    options = _PAPERS_OPTIONS if name == _PAPERS else (FILTER_OPTION,)
    return (name, *(f"{name}/{option}" for option in options))


def _shown(family: str) -> tuple[str, ...]:
    """Return a family's names: alone, inside the filter, inside what it learned in."""
    trained_in = load_family(family)[0].card.trained_inside
    options = (
        (FILTER_OPTION,) if trained_in in (None, FILTER_OPTION) else (FILTER_OPTION, trained_in)
    )
    return (family, *(f"{family}/{option}" for option in options))


def _on_the_other(family: str) -> tuple[str, ...]:
    """Return a family's name on the inner loop that feels the load, if it did not learn on it."""
    learned_on = f"{INNER_LOOP_MARK}{inner_loop_of_family(family)}"
    return () if learned_on == OTHER_INNER_LOOP else (family + OTHER_INNER_LOOP,)


def known_names() -> tuple[str, ...]:
    """Return the names of all contestants that can be asked for, the standard ones first.

    Any ``module:factory`` can be, too, alone or inside a filter.
    """
    # none is made here: one that somebody's package cannot make is no obstacle to the others
    families, registered = shipped_families(), registered_controllers()
    bases = (*registered, *families, *(other for f in families for other in _on_the_other(f)))
    every = (name for base in bases for name in (base, *(f"{base}/{o}" for o in OPTIONS)))
    return tuple(dict.fromkeys((*standard_names_with(registered), *every)))


def require_undisputed(names: Iterable[str]) -> None:
    """Raise ControllerError if a name asked for is one that an installed package may not give."""
    refused = registrations().refused
    for name in names:
        for other, error in refused.items():
            if name == other or name.startswith((f"{other}/", f"{other}{INNER_LOOP_MARK}")):
                raise error


def standard_contestants(
    names: Sequence[str], certificates: Certificates, member_limit: int | None = None
) -> tuple[Contestant, ...]:
    """Return contestants in the order of ``known_names``, then those of ``module:factory``.

    Args:
        names: of those wanted.
        certificates: where theirs come from; no others are made.
        member_limit: how many members of a learned contestant take part, lowest seeds first; all
            by default.

    Raises:
        ParameterError: an unknown name.
        ControllerError: a ``module:factory`` or a registered one that leads to no controller.
        AgentFileError: an agent cannot be loaded or does not fit the environment.
    """
    guests = tuple(dict.fromkeys(name for name in names if is_reference(name)))
    known, registered = known_names(), registered_controllers()
    for name in names:
        if name in guests:
            method = name.partition("/")[2]
            require_choice(f"what {name} runs inside", method, ("", *OPTIONS))
        else:
            require_choice("contestants", name, known)
    wanted = (*(name for name in known if name in set(names)), *guests)
    return tuple(_contestant(name, registered, certificates, member_limit) for name in wanted)


def _contestant(
    name: str, registered: Mapping[str, str], certificates: Certificates, member_limit: int | None
) -> Contestant:
    base, _, method = name.partition("/")
    if base in _REFERENCES:
        return _REFERENCES[base]
    if is_reference(base):
        return controller_contestant(base, base, method, certificates)
    if base in registered:
        try:
            return controller_contestant(base, registered[base], method, certificates)
        except (ControllerError, InstallationError) as error:
            told = named(base, error)
            raise told from told.__cause__
    return family_contestant(name, certificates, member_limit)


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
