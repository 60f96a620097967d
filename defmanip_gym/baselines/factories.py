"""Controllers from ``module:factory``, which may be anybody's and may fail in any way.

A factory takes the definition of the environment as controllers may know it, and returns a
controller. Whatever else happens ends in a ControllerError that tells what and where.
"""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from traceback import extract_tb
from typing import Any, Protocol

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.registrations import OWN_PACKAGE
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ControllerError, DefmanipError
from defmanip_gym.theory.certificates import Certificate

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


def is_reference(name: str) -> bool:
    """Whether a name is a ``module:factory``."""
    return ":" in name


def factory_at(reference: str) -> Any:
    """Return what ``module:factory`` names; modules of the working directory are found, too.

    Raises:
        ControllerError: the module is not there or cannot be imported, or there is nothing
            callable of that name in it.
    """
    module, _, name = reference.partition(":")
    if not all(part.isidentifier() for part in (*module.split("."), name)):
        raise _unusable(reference, "a name of the form module:factory", f"As in {_EXAMPLE}.")
    _see_working_directory()
    try:
        imported = importlib.import_module(module)
    except (Exception, SystemExit) as error:
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing is not None and f"{module}.".startswith(f"{missing}."):
            remedy = f"There is no {missing!r} here: install it, or run where it lies."
        else:
            remedy = what_was_raised(error)
        raise _unusable(reference, "a module that can be imported", remedy) from error
    factory = getattr(imported, name, None)
    if not callable(factory):
        raise _unusable(reference, f"a function in {module}", f"It has no function {name!r}.")
    return factory


def make_controller(
    reference: str, config: TransportConfig, certificate: Certificate | None = None
) -> Controller:
    """Return the controller that a factory makes; see ``Factory`` and ``BoundedFactory``.

    Raises:
        ControllerError: the reference leads nowhere, or to something that makes no controller for
            the environment. Factories of this package raise their own errors.
    """
    factory = factory_at(reference)
    options = {} if certificate is None else {"certificate": certificate}
    _require_callable_with(reference, factory, config, options)
    try:
        made = factory(config, **options)
    except (Exception, SystemExit) as error:
        if isinstance(error, DefmanipError) and is_own(reference):
            raise
        allowed = "a factory that makes a controller for the environment"
        raise _unusable(reference, allowed, what_was_raised(error)) from error
    if isinstance(made, type) or not callable(getattr(made, "predict", None)):
        raise _unusable(
            f"{reference} → {made if isinstance(made, type) else type(made).__name__}",
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


def is_own(reference: str) -> bool:
    """Whether a ``module:factory`` is this package's."""
    return reference.startswith(f"{OWN_PACKAGE}.")


def what_was_raised(error: BaseException) -> str:
    """Return a sentence on what others' code has raised, and where."""
    ours = (str(Path(__file__).parents[1]), str(importlib.__file__), "<")  # "<" is not in a file
    lines = [
        f"{frame.filename}, line {frame.lineno}"
        for frame in extract_tb(error.__traceback__)
        if not frame.filename.startswith(ours)
    ]
    where = f" ({lines[-1]})" if lines else ""
    return f"It raised {type(error).__name__}: {error}{where}."


def _require_callable_with(
    reference: str, factory: Any, config: TransportConfig, options: Mapping[str, Any]
) -> None:
    """Raise ControllerError if a factory takes other arguments than it gets."""
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):  # some of C tell none
        return
    try:
        signature.bind(config, **options)
    except TypeError as error:
        given = ", ".join(("config", *(f"{name}=..." for name in options)))
        raise _unusable(
            f"{reference}{signature}", f"a factory that can be called with ({given})", f"{error}."
        ) from error


def _see_working_directory() -> None:
    """Let modules of the working directory be imported; an installed command would not see them."""
    here = str(Path.cwd())
    if here not in sys.path and "" not in sys.path:
        sys.path.append(here)


def _unusable(reference: str, allowed: str, remedy: str) -> ControllerError:
    return ControllerError("controller", reference, allowed, remedy)
