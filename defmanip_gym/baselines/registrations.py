"""What installed packages register as controllers, and which of it has a name of its own.

A name that this package uses stays this package's: nobody's controller runs in another's place.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import distributions

from defmanip_gym.baselines.learned.families import shipped_families
from defmanip_gym.errors import ControllerError
from defmanip_gym.theory.certificates import CERTIFICATE_METHODS
from defmanip_gym.theory.filters.family import FILTERS

CONTROLLER_GROUP = "defmanip_gym.controllers"  # of entry points
OWN_PACKAGE = "defmanip_gym"
REFERENCES = ("zero", "random")  # which are no factory's

# other characters have a meaning where contestants are named, or their files
_NAME = re.compile(r"\w[\w.-]*")


@dataclass(frozen=True, kw_only=True)
class Registrations:
    """Entry points of the group, in alphabetical order.

    Attributes:
        usable: ``module:factory`` by name.
        refused: why others are not, by name; one that is this package's is then usable, too.
    """

    usable: Mapping[str, str]
    refused: Mapping[str, ControllerError]


def registrations() -> Registrations:
    """Return what all installed packages register."""
    usable, refused = {}, {}
    for name, by_package in sorted(_by_name().items()):
        own = by_package.get(OWN_PACKAGE)
        others = {package: each for package, each in by_package.items() if each != own}
        if own is not None:
            usable[name] = own
        if others and (allowed := _allowed(name, others, own)):
            refused[name] = _refused(name, others, allowed)
        elif others:
            (usable[name],) = set(others.values())
    return Registrations(usable=usable, refused=refused)


def _by_name() -> dict[str, dict[str, str]]:
    """Return ``module:factory`` by package by name; of a package's descriptions, the first."""
    # all of them count: one that a build left in the checkout may be out of date
    found: dict[str, dict[str, str]] = {}
    for package in distributions():
        for point in package.entry_points.select(group=CONTROLLER_GROUP):
            owner = re.sub(r"[-_.]+", "_", str(package.name)).lower()  # as indices compare them
            found.setdefault(point.name, {}).setdefault(owner, point.value)
    return found


def _allowed(name: str, others: Mapping[str, str], own: str | None) -> str | None:
    """Return what a name that others have given had to be, or None if it may stay."""
    if own is not None:
        return f"a free name: {name!r} is {own} of {OWN_PACKAGE}"
    for kind, names in (
        ("contestant in every comparison", REFERENCES),
        ("family of shipped agents", shipped_families()),
        ("safety filter", (*FILTERS, *CERTIFICATE_METHODS)),
    ):
        if name in names:
            return f"a free name: {name!r} is a {kind} of {OWN_PACKAGE}"
    if _NAME.fullmatch(name) is None:
        return "a name of letters, digits, '_', '-' and '.' that begins with none of the last two"
    if len(set(others.values())) > 1:
        return "one for each name"
    return None


def _refused(name: str, others: Mapping[str, str], allowed: str) -> ControllerError:
    packages, references = " and ".join(others), " and ".join(others.values())
    return ControllerError(
        f"controller {name!r} of {packages}",
        references,
        allowed,
        f"Rename the entry point, or uninstall {packages}. It can still be asked for as "
        f"{references}.",
    )
