"""The state of episodes with the memories of all wrappers around them."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

from defmanip_gym.errors import StateError

_OF_THE_ENVIRONMENT = {
    "_action_space",
    "_observation_space",
    "_single_action_space",
    "_single_observation_space",
    "_metadata",
    "_cached_spec",
}


def get_state(env: Any) -> dict[str, Any]:
    """Return all that the future of an environment's episodes depends on.

    That is physics, generators, noise, step counts and drawn beams, and what every wrapper has
    noted. A wrapper names the attributes that it has to remember in ``remembers``; of others, all
    are copied.

    Args:
        env: a transport environment, single or batched, in any wrappers.

    Raises:
        StateError: another environment, or a wrapper that cannot be copied.
    """
    return {
        "episodes": _episodes(env).get_state(),
        "wrappers": [
            {"name": type(layer).__name__, "memory": _remembered(layer, env)}
            for layer in wrappers(env)
        ],
    }


def set_state(env: Any, state: dict[str, Any]) -> None:
    """Go on from what :func:`get_state` returned: the same actions give the same episodes.

    Args:
        env: made like the one that the state is from, with the same wrappers.
        state: which is not changed, and may be set again.

    Raises:
        StateError: other wrappers, other beam segments or another number of episodes.
    """
    episodes, layers = _episodes(env), list(wrappers(env))
    names = [type(layer).__name__ for layer in layers]
    try:
        kept = [(entry["name"], entry["memory"]) for entry in state["wrappers"]]
        inner = state["episodes"]
    except (TypeError, LookupError) as error:
        raise StateError("state", state, "what get_state(env) returns", "Take it there.") from error
    if [name for name, _ in kept] != names:
        raise StateError(
            "wrappers of the state",
            [name for name, _ in kept],
            f"{names}, as around this environment",
            "Wrap both alike, or hand on env.unwrapped.get_state(), which leaves wrappers out.",
        )
    episodes.set_state(inner)
    for layer, (_, memory) in zip(layers, kept, strict=True):
        _remember(layer, memory, env)


def wrappers(env: Any) -> Iterator[Any]:
    """Yield the wrappers of an environment, the outermost first."""
    layer = env
    while layer is not env.unwrapped:
        yield layer
        layer = layer.env


def _episodes(env: Any) -> Any:
    episodes = getattr(env, "unwrapped", env)
    if not (hasattr(episodes, "get_state") and hasattr(episodes, "set_state")):
        raise StateError(
            "env",
            env,
            "a DeformTransport environment",
            "Of several in one vector environment, ask each: envs.call('get_state').",
        )
    return episodes


def _remembered(thing: Any, env: Any) -> dict[str, Any]:
    """Return copies of what a wrapper, or a part of one, has noted."""
    memory = {}
    for name in _noted(thing, env):
        value = getattr(thing, name)
        is_part = hasattr(type(value), "remembers")
        memory[name] = _remembered(value, env) if is_part else _copied(thing, value, env)
    return memory


def _remember(thing: Any, memory: Mapping[str, Any], env: Any) -> None:
    for name, kept in memory.items():
        value = getattr(thing, name, None)
        if hasattr(type(value), "remembers"):
            _remember(value, kept, env)
        else:
            setattr(thing, name, _copied(thing, kept, env))


def _noted(thing: Any, env: Any) -> list[str]:
    named = getattr(type(thing), "remembers", None)
    if named is not None:
        return list(named)
    layers = _layers(env)
    return [
        name
        for name, value in vars(thing).items()
        if name not in _OF_THE_ENVIRONMENT and id(value) not in layers
    ]


def _layers(env: Any) -> dict[int, Any]:
    return {id(layer): layer for layer in (*wrappers(env), env.unwrapped)}


def _copied(thing: Any, value: Any, env: Any) -> Any:
    """Return a copy that refers to the same environment and wrappers, where it does so."""
    memo = _layers(env)
    try:
        return copy.deepcopy(value, memo)
    except Exception as error:  # whatever locks, windows and files raise
        raise StateError(
            "wrapper",
            thing,
            "one whose attributes can be copied",
            "Let its class name what it has to remember: remembers = ('_count', ...).",
        ) from error
