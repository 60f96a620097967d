"""DAQP, which solves small quadratic programs exactly; an optional package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from defmanip_gym.errors import InstallationError


def daqp_solver(user: str) -> Callable[..., Any]:
    """Return DAQP's function that solves a program.

    Args:
        user: what needs it, for the message.

    Raises:
        InstallationError: DAQP is not installed.
    """
    try:
        from daqp import solve
    except ModuleNotFoundError as error:
        raise InstallationError(
            f"the package that {user} needs",
            error.name,
            "one that is installed",
            "Install it with: pip install 'defmanip_gym[qp]'.",
        ) from error
    solver: Callable[..., Any] = solve
    return solver
