"""The state of episodes with the memories of all wrappers around them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from defmanip_gym.envs.memories import give_memory, memory_of, require_memory
from defmanip_gym.errors import StateError


def get_state(env: Any) -> dict[str, Any]:
    """Return all that the future of an environment's episodes depends on.

    That is physics, generators, noise, step counts and drawn beams, and what every wrapper has
    noted: the attributes that its class names in ``remembers``, or else all that are data.

    Args:
        env: a transport environment, single or batched, in any wrappers.

    Raises:
        StateError: another environment, or a wrapper of which it cannot be told.
    """
    return {
        "episodes": _episodes(env).get_state(),
        "wrappers": [
            {"name": type(layer).__name__, "memory": memory_of(layer)} for layer in wrappers(env)
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
    for layer, (_, memory) in zip(layers, kept, strict=True):
        require_memory(layer, memory)
    episodes.set_state(inner)
    for layer, (_, memory) in zip(layers, kept, strict=True):
        give_memory(layer, memory)


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
            "Use make_vec, whose batch is one environment, or ask the single ones.",
        )
    return episodes
