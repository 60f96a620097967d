"""What wrappers have noted: their memories, as copies."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Mapping
from enum import Enum
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.errors import StateError

_OF_THE_ENVIRONMENT = {
    "env",
    "_action_space",
    "_observation_space",
    "_single_action_space",
    "_single_observation_space",
    "_metadata",
    "_cached_spec",
    "_saved_kwargs",
}
_VALUES = (bool, int, float, complex, str, bytes, Enum, np.ndarray, np.generic, np.random.Generator)
_CONTAINERS = (list, tuple, set, frozenset, deque)
_FIXED = (gymnasium.Env, gymnasium.vector.VectorEnv, gymnasium.Space)


def memory_of(layer: Any) -> dict[str, Any]:
    """Return copies of what a wrapper, or a part of one, has noted.

    Its class names the attributes in ``remembers``. Of others it is all attributes that are data;
    arguments of the constructor, functions, spaces and environments are how it was made.

    Raises:
        StateError: an attribute that might be either.
    """
    return {name: _copied(getattr(layer, name)) for name in _noted(layer)}


def require_memory(layer: Any, memory: object) -> None:
    """Raise StateError unless such a memory can be given to a wrapper.

    Its class may ask for more of it, in a method ``require_memory``.
    """
    noted = set(_noted(layer))
    if not isinstance(memory, Mapping) or set(memory) != noted:
        raise StateError(
            f"memory of {type(layer).__name__}",
            memory,
            f"a dict with the keys {', '.join(sorted(noted))}",
            "Take it from get_state of an environment in the same wrappers.",
        )
    for name, kept in memory.items():
        if _is_part(value := getattr(layer, name)):
            require_memory(value, kept)
    if hasattr(type(layer), "require_memory"):
        layer.require_memory(memory)


def give_memory(layer: Any, memory: Mapping[str, Any]) -> None:
    """Let a wrapper go on from a memory, of which it gets copies."""
    for name, kept in memory.items():
        if _is_part(value := getattr(layer, name)):
            give_memory(value, kept)
        else:
            given = copy.deepcopy(kept)
            # in a file named tuples become lists
            setattr(layer, name, type(value)._make(given) if hasattr(value, "_make") else given)


def _is_part(value: Any) -> bool:
    return hasattr(type(value), "remembers")


def _copied(value: Any) -> Any:
    return memory_of(value) if _is_part(value) else copy.deepcopy(value)


def _noted(layer: Any) -> list[str]:
    named = getattr(type(layer), "remembers", None)
    if named is not None:
        return list(named)
    arguments = getattr(layer, "_saved_kwargs", {})
    noted = []
    for name, value in vars(layer).items():
        if name in _OF_THE_ENVIRONMENT or name.lstrip("_") in arguments:
            continue
        is_data = _is_data(value, set())
        if is_data is None:
            raise StateError(
                f"{type(layer).__name__}.{name}",
                value,
                "data, or what the wrapper was made with",
                "Let its class name what it has to remember: remembers = ('_count', ...).",
            )
        if is_data:
            noted.append(name)
    return noted


def _is_data(value: Any, seen: set[int]) -> bool | None:
    """Whether a value is data; None of what might be and cannot be told."""
    if value is None or isinstance(value, _VALUES) or id(value) in seen:
        return True
    if callable(value) or isinstance(value, _FIXED):
        return False
    seen.add(id(value))
    if isinstance(value, _CONTAINERS):
        items = list(value)
    elif isinstance(value, Mapping):
        items = list(value.values())
    elif hasattr(value, "__dict__"):
        items = list(vars(value).values())
    else:
        return None
    kinds = [_is_data(item, seen) for item in items]
    return None if None in kinds else all(kinds)
