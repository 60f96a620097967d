"""Running the episodes of a dataset, batch by batch, in the environment that it names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import gymnasium

from defmanip_gym.datasets.mixture import Part
from defmanip_gym.envs.config import ConstraintMode, InnerLoopKind, TransportConfig
from defmanip_gym.evaluation.course import Course
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.evaluation.rollout import courses
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.wrappers.transport import transport_config

_BATCH = 128  # courses of a batch are in memory at once, at most 300 kB each


def environment(
    env_id: str, inner_loop: InnerLoopKind, constraint_mode: ConstraintMode
) -> gymnasium.Env[Any, Any]:
    """Return the single environment that makes a dataset's episodes again.

    Args:
        env_id: without a module.
        inner_loop: between the task acceleration and the forces.
        constraint_mode: what exceeding σ does.
    """
    defaults = TransportConfig()
    given = {"inner_loop": inner_loop, "constraint_mode": constraint_mode}
    changed: dict[str, Any] = {n: v for n, v in given.items() if v != getattr(defaults, n)}
    return gymnasium.make(f"defmanip_gym:{env_id}", **changed)


def episodes_of(part: Part, env: gymnasium.Env[Any, Any]) -> Iterator[tuple[Course, ...]]:
    """Yield what happens in the episodes of a part, batch by batch.

    An episode depends on its seed and its controller alone, not on its batch.

    Args:
        part: whose episodes.
        env: as ``environment`` makes it.
    """
    for first in range(0, len(part.seeds), _BATCH):
        yield _batch(part, env, part.seeds[first : first + _BATCH])


def _batch(part: Part, env: gymnasium.Env[Any, Any], seeds: Sequence[int]) -> tuple[Course, ...]:
    config, protection = transport_config(env), part.contestant.protection
    assert env.spec is not None and env.spec.max_episode_steps is not None  # a registered one
    return courses(
        part.member.controller.build(seeds),
        seeds,
        config=config,
        steps=env.spec.max_episode_steps,
        safety_filter=None if protection is None else _filter(protection, config),
    )


@lru_cache(maxsize=8)
def _filter(protection: Protection, config: TransportConfig) -> SafetyFilter:
    """Return a filter, whose errors are searched for once for all batches."""
    return protection.filter_in(config)
