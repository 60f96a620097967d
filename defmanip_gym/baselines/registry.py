"""Registered controllers by name, and what controllers tell of themselves.

The package's own are registered as anybody's are, as entry points in its ``pyproject.toml``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, cast, get_args

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.factories import is_own, make_controller, what_was_raised
from defmanip_gym.baselines.registrations import registrations
from defmanip_gym.envs.config import InnerLoopKind, TransportConfig
from defmanip_gym.errors import ControllerError, InvalidValueError


@dataclass(frozen=True, kw_only=True)
class Told:
    """What a controller tells of itself.

    Attributes:
        inner_loop: that it is made for.
        knows: beyond the observation; None if it says nothing.
    """

    inner_loop: InnerLoopKind
    knows: str | None


@dataclass(frozen=True, kw_only=True)
class Survey:
    """Registered controllers, in alphabetical order.

    Attributes:
        available: ``module:factory`` by name, of those that can be made here.
        left_out: why others are not.
    """

    available: Mapping[str, str]
    left_out: tuple[InvalidValueError, ...]


def registered_controllers() -> dict[str, str]:
    """Return ``module:factory`` by name, of all installed packages, in alphabetical order.

    Those whose names are taken are not among them; see ``registrations``.
    """
    return dict(registrations().usable)


def surveyed_controllers() -> Survey:
    """Return which of the registered controllers can be made with what is installed."""
    found, available = registrations(), {}
    left_out: list[InvalidValueError] = [*found.refused.values()]
    for name, reference in found.usable.items():
        try:
            told_by(reference, TransportConfig())
            available[name] = reference
        except InvalidValueError as error:
            left_out.append(named(name, error))
    return Survey(available=available, left_out=tuple(left_out))


def available_controllers() -> dict[str, str]:
    """Return those that can be made with the packages that are installed."""
    return dict(surveyed_controllers().available)


def told_by(reference: str, config: TransportConfig) -> Told:
    """Return what the controller of a reference tells of itself, made for an environment.

    Raises:
        ControllerError: it cannot be made, or tells something else than it may.
        InstallationError: one of this package's needs a package that is not installed.
    """
    controller = make_controller(reference, config)
    identity_of(reference, controller)
    knows = _attribute(reference, controller, "knows")
    if knows is not None and not isinstance(knows, str):
        raise ControllerError(f"knows of {reference}", knows, "a text", "Describe it in words.")
    return Told(inner_loop=inner_loop_of(reference, controller), knows=knows)


def named(name: str, error: InvalidValueError) -> InvalidValueError:
    """Return an error about a registered controller's reference with its name and cause."""
    told = type(error)(
        f"controller {name!r}: {error.name}", error.value, error.allowed, error.remedy
    )
    told.__cause__ = error.__cause__ or error
    return told


def identity_of(reference: str, controller: Controller) -> dict[str, Any]:
    """Return what a controller's behaviour depends on, as JSON values.

    That is what its attribute ``identity`` tells, if it has one, and, of a module of another
    package, the contents of that package's Python files.

    Raises:
        ControllerError: the attribute holds something else than JSON values.
    """
    identity = _attribute(reference, controller, "identity")
    told = {"controller": reference, "identity": identity}
    try:
        json.dumps(identity)
    except (TypeError, ValueError) as error:
        raise ControllerError(
            f"identity of {reference}",
            identity,
            "JSON values: mappings, lists, strings, numbers",
            f"{error}; write arrays as lists.",
        ) from error
    if is_own(reference):
        return told  # whose version is known to records
    return told | {"source": _digest(reference.partition(":")[0].partition(".")[0])}


def inner_loop_of(reference: str, controller: Controller) -> InnerLoopKind:
    """Return the inner loop that a controller is made for: its attribute, if it has one.

    Raises:
        ControllerError: there is no such inner loop.
    """
    kinds = get_args(InnerLoopKind)
    kind = _attribute(reference, controller, "inner_loop", kinds[0])
    if not isinstance(kind, str) or kind not in kinds:
        raise ControllerError(
            f"inner_loop of {reference}", kind, f"one of {', '.join(kinds)}", "See TransportConfig."
        )
    return cast(InnerLoopKind, kind)


def _digest(package: str) -> str:
    """Return the SHA-256 of a module's file, or of all Python files of a package."""
    try:
        spec = find_spec(package)
    except ValueError as error:  # of __main__, for one
        raise ControllerError(
            "controller's module", package, "one that an import finds", f"{error}."
        ) from error
    folders = [] if spec is None else list(spec.submodule_search_locations or ())
    files = sorted(path for folder in folders for path in Path(folder).rglob("*.py"))
    if not folders and spec is not None and spec.origin is not None:
        files = [Path(spec.origin)]
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _attribute(
    reference: str, controller: Controller, name: str, otherwise: object = None
) -> object:
    """Return an attribute of a controller, which may be a property that fails."""
    try:
        return getattr(controller, name, otherwise)
    except Exception as error:
        allowed = "one that can be read, or none"
        raise ControllerError(
            f"{name} of the controller", reference, allowed, what_was_raised(error)
        ) from error
