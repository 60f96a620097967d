"""What safety filters cost: a batch with and without, in turns, and a single decision.

Actions are stored beforehand; half of them pump the swing, so that filters have something to do.

    python benchmarks/speed/filters.py
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.filters.family import REFERENCE_FILTERS, STORAGE_FILTERS
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

_STEPS = 300


def batch(count: int, made: StorageFilter | None) -> Any:
    """Return a batch, inside a filter or not."""
    env: Any = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0", num_envs=count, constraint_mode="cost"
    )
    env = env if made is None else SafetyFilterVectorWrapper(env, made)
    env.reset(seed=0)
    return env


def duration_s(env: Any, actions: np.ndarray) -> float:
    """Return how long it takes to step a batch through actions, (T, n, 3)."""
    begin = time.perf_counter()
    for each in actions:
        env.step(each)
    return time.perf_counter() - begin


def decisions_s(made: StorageFilter, observations: np.ndarray) -> tuple[float, float]:
    """Return median and 99th percentile of the time of a decision at n = 1, conclusion included."""
    memory = made.memory(1)
    made.begin(memory, observations[:1], np.array([True]))
    samples = []
    for row in observations[:, None]:
        begin = time.perf_counter()
        made.certify_action([[3.0, -3.0, 1.0]], row, memory)
        made.conclude(row, memory)
        samples.append(time.perf_counter() - begin)
    return float(np.median(samples)), float(np.quantile(samples, 0.99))


def pumped(made: StorageFilter) -> np.ndarray:
    """Return observations of an episode in which the swing is pumped through the filter."""
    beam = made.beam
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0", num_envs=1, constraint_mode="cost", beam=beam
    )
    env = SafetyFilterVectorWrapper(env, made)
    observation, _ = env.reset(seed=0)
    rows, rate = [], 14 + beam.segment_count
    for _ in range(_STEPS):
        rows.append(observation[0].copy())
        push = -np.where(observation[:, rate] < 0, -1.0, 1.0)
        observation, *_ = env.step(np.stack((push, 0 * push, 0 * push), axis=1))
    return np.array(rows)


def main() -> None:
    """Print a line for each filter."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--num-envs", type=int, default=256)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (_STEPS, options.num_envs, 3))
    bare = batch(options.num_envs, None)
    for name, kind in (STORAGE_FILTERS | REFERENCE_FILTERS).items():
        wrapped = batch(options.num_envs, kind(BeamParams()))
        ratios = []
        for _ in range(options.rounds):
            alone = duration_s(bare, actions)
            ratios.append(duration_s(wrapped, actions) / alone)
        print(
            f"{name}: a batch of {options.num_envs} takes {np.median(ratios):.3f} of the time "
            f"({min(ratios):.3f} to {max(ratios):.3f})",
            flush=True,
        )
        for segments in (1, 8):
            made = kind(BeamParams(segment_count=segments))
            median, slow = decisions_s(made, pumped(made))
            print(
                f"  N = {segments}, n = 1: {1e6 * median:.0f} µs a decision, 99 % below "
                f"{1e6 * slow:.0f} µs",
                flush=True,
            )


if __name__ == "__main__":
    main()
