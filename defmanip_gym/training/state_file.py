"""Nested plain values and arrays on disk, exactly and without pickle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

_VALUES, _ARRAYS = "state.json", "state.npz"
_MARK = "array"  # stands for an array in the JSON file


def write_state(folder: Path, state: Any) -> None:
    """Write dicts with text as keys, lists, tuples, numbers, text, None and arrays.

    Raises:
        TypeError: something else.
    """
    arrays: dict[str, Any] = {}
    values = _without_arrays(state, arrays)
    np.savez(folder / _ARRAYS, **arrays)
    (folder / _VALUES).write_text(json.dumps(values))


def read_state(folder: Path) -> Any:
    """Return what ``write_state`` wrote; tuples have become lists.

    Raises:
        OSError: a file is missing.
        KeyError: an array is missing.
        ValueError: a damaged file, or one that holds Python objects.
    """
    with np.load(folder / _ARRAYS, allow_pickle=False) as arrays:
        return _with_arrays(read_values(folder), arrays)


def read_values(folder: Path) -> Any:
    """Return the same without the arrays, quickly.

    Raises:
        OSError: the file is missing.
        ValueError: the file is damaged.
    """
    return json.loads((folder / _VALUES).read_text())


def _without_arrays(state: Any, arrays: dict[str, Any]) -> Any:
    """Return ``state`` with a name in the place of each array, and add those to ``arrays``."""
    if isinstance(state, dict):
        return {key: _without_arrays(value, arrays) for key, value in state.items()}
    if isinstance(state, list | tuple):
        return [_without_arrays(value, arrays) for value in state]
    if isinstance(state, np.ndarray | np.generic):  # NumPy's numbers keep their type so
        if state.dtype.hasobject:
            raise TypeError(f"{state!r} holds objects, which only pickle could write.")
        name = str(len(arrays))
        arrays[name] = state
        return {_MARK: name}
    return state


def _with_arrays(state: Any, arrays: Any) -> Any:
    if isinstance(state, dict):
        if set(state) == {_MARK}:
            array = arrays[state[_MARK]]
            return array if array.ndim else array[()]
        return {key: _with_arrays(value, arrays) for key, value in state.items()}
    if isinstance(state, list):
        return [_with_arrays(value, arrays) for value in state]
    return state
