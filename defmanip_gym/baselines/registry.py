"""Controllers by name: entry points of installed packages, and ``module:factory`` for any other.

A factory takes the definition of the environment as controllers may know it, and returns a
controller. The package's own are registered as anybody's are, in its ``pyproject.toml``.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import sys
from importlib.metadata import distributions
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol, cast, get_args

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.envs.config import InnerLoopKind, TransportConfig
from defmanip_gym.errors import ControllerError, InstallationError
from defmanip_gym.theory.certificates import Certificate

CONTROLLER_GROUP = "defmanip_gym.controllers"  # of entry points

_OWN = "defmanip_gym"
_EXAMPLE = "my_package.my_module:make_controller"


class Factory(Protocol):
    """Makes a controller for an environment."""

    def __call__(self, config: TransportConfig) -> Controller:
        """Return the controller.

        Args:
            config: the nominal environment: task, σ, and robot and beam as everybody believes them.
        """
        ...


class BoundedFactory(Protocol):
    """One that can also keep to a certificate's bounds by itself."""

    def __call__(
        self, config: TransportConfig, certificate: Certificate | None = None
    ) -> Controller:
        """Return the controller, within the certificate's bounds if given one."""
        ...


def registered_controllers() -> dict[str, str]:
    """Return ``module:factory`` by name, of all installed packages, in alphabetical order.

    Raises:
        ControllerError: two packages give one name to different factories.
    """
    # all descriptions of a package count: one that a build left in the checkout may be out of date
    found: dict[str, str] = {}
    owners: dict[str, str] = {}
    for package in distributions():
        for point in package.entry_points.select(group=CONTROLLER_GROUP):
            owner = owners.setdefault(point.name, package.name)
            if found.setdefault(point.name, point.value) != point.value and owner != package.name:
                both = f"{found[point.name]} and {point.value}"
                raise _unusable(f"{point.name!r}: {both}", "one for each name", "Rename one.")
    return dict(sorted(found.items()))


def available_controllers() -> dict[str, str]:
    """Return those that can be made with the packages that are installed."""
    return {name: each for name, each in registered_controllers().items() if _can_be_made(each)}


def is_reference(name: str) -> bool:
    """Whether a name is a ``module:factory``."""
    return ":" in name


def factory_at(reference: str) -> Any:
    """Return what ``module:factory`` names; modules of the working directory are found, too.

    Raises:
        ControllerError: there is no such module or nothing callable of that name in it. What a
            module raises when it is imported comes through as it is.
    """
    module, _, name = reference.partition(":")
    if not all(part.isidentifier() for part in (*module.split("."), name)):
        raise _unusable(reference, "a name of the form module:factory", f"As in {_EXAMPLE}.")
    _see_working_directory()
    try:
        imported = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise  # what it needs itself
        raise _unusable(
            reference,
            "a module that can be imported",
            f"There is no {error.name!r} here: install it, or run where it lies.",
        ) from error
    factory = getattr(imported, name, None)
    if not callable(factory):
        raise _unusable(reference, f"a function in {module}", f"It has no function {name!r}.")
    return factory


def make_controller(
    reference: str, config: TransportConfig, certificate: Certificate | None = None
) -> Controller:
    """Return the controller that a factory makes; see ``Factory`` and ``BoundedFactory``.

    Raises:
        ControllerError: the reference leads nowhere, or to something without ``predict``.
    """
    factory = factory_at(reference)
    made = factory(config) if certificate is None else factory(config, certificate=certificate)
    if not callable(getattr(made, "predict", None)):
        raise _unusable(
            f"{reference} → {type(made).__name__}",
            "a factory of objects with SB3's predict(observation, state, episode_start, "
            "deterministic)",
            "Return a controller.",
        )
    controller: Controller = made
    return controller


def summary_of(reference: str) -> str:
    """Return the first sentence of a factory's docstring, without its full stop."""
    text = (factory_at(reference).__doc__ or "").strip().partition("\n\n")[0]
    return " ".join(text.split()).rstrip(".") or f"Made by {reference}"


def identity_of(reference: str, controller: Controller) -> dict[str, Any]:
    """Return what a controller's behaviour depends on, as JSON values.

    That is what its attribute ``identity`` tells, if it has one, and, of a module of another
    package, the contents of that package's Python files.

    Raises:
        ControllerError: the attribute holds something else than JSON values.
    """
    identity = getattr(controller, "identity", None)
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
    if reference.startswith(f"{_OWN}."):
        return told  # whose version is known to records
    return told | {"source": _digest(reference.partition(":")[0].partition(".")[0])}


def inner_loop_of(reference: str, controller: Controller) -> InnerLoopKind:
    """Return the inner loop that a controller is made for: its attribute, if it has one.

    Raises:
        ControllerError: there is no such inner loop.
    """
    kinds = get_args(InnerLoopKind)
    kind = getattr(controller, "inner_loop", kinds[0])
    if kind not in kinds:
        raise ControllerError(
            f"inner_loop of {reference}", kind, f"one of {', '.join(kinds)}", "See TransportConfig."
        )
    return cast(InnerLoopKind, kind)


def _digest(package: str) -> str:
    """Return the SHA-256 of a module's file, or of all Python files of a package."""
    spec = find_spec(package)
    folders = [] if spec is None else list(spec.submodule_search_locations or ())
    files = sorted(path for folder in folders for path in Path(folder).rglob("*.py"))
    if not folders and spec is not None and spec.origin is not None:
        files = [Path(spec.origin)]
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _can_be_made(reference: str) -> bool:
    try:
        make_controller(reference, TransportConfig())
    except InstallationError:
        return False
    return True


def _see_working_directory() -> None:
    """Let modules of the working directory be imported; an installed command would not see them."""
    here = str(Path.cwd())
    if here not in sys.path and "" not in sys.path:
        sys.path.append(here)


def _unusable(reference: str, allowed: str, remedy: str) -> ControllerError:
    return ControllerError("controller", reference, allowed, remedy)
