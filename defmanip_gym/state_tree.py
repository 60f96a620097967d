"""States as trees of dicts, arrays and plain values: whether one fits in the place of another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from defmanip_gym.errors import StateError


def fitted(name: str, given: Any, own: Any) -> Any:
    """Return a copy of ``given`` in the shape of ``own``.

    Arrays have one row for each episode; a single row serves all episodes.

    Args:
        name: of the state, for the error.
        given: what is to become the state.
        own: what it is to replace.

    Raises:
        StateError: it is made of other parts, or of arrays of other shapes or kinds.
    """
    if isinstance(own, dict):
        if not isinstance(given, Mapping) or set(given) != set(own):
            raise StateError(name, given, f"a dict with the keys {', '.join(own)}", _REMEDY)
        return {key: fitted(f"{name}[{key!r}]", given[key], value) for key, value in own.items()}
    if not isinstance(own, np.ndarray):
        return given
    try:
        array = np.asarray(given)
        if array.shape[:1] == (1,):
            array = np.broadcast_to(array, (len(own), *array.shape[1:]))
        return _like(array, own)
    except (TypeError, ValueError) as error:
        shape = getattr(given, "shape", given)
        raise StateError(f"{name}.shape", shape, f"{own.shape}", _REMEDY) from error


def require_drawn(name: str, used: Any, drawn: int) -> None:
    """Raise StateError unless each number of used draws, (n,), is from 0 to ``drawn``."""
    if ((used < 0) | (used > drawn)).any():
        raise StateError(name, used.tolist(), f"from 0 to {drawn}", _REMEDY)


def _like(array: Any, own: Any) -> Any:
    if array.shape != own.shape:
        raise ValueError("another shape")
    return np.array(array.astype(own.dtype, casting="same_kind"), order="C")


_REMEDY = "Take it from get_state of an environment with as many episodes and beam segments."
