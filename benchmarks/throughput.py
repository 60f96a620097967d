"""Environment throughput against the physics alone, as ratios taken in one run.

Every candidate runs in turn, several rounds, so that what else the machine does hits all alike.
The anchor is ``mujoco.batch.Batch.step`` on the same model, substeps and threads: the limit is 1.

    python benchmarks/throughput.py
    python benchmarks/throughput.py --num-envs 256 --control-mode force --segments 4
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import gymnasium
import numpy as np
import tyro
from mujoco import batch
from rich.console import Console
from rich.table import Table

from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.params import BeamParams

ENV_ID = "defmanip_gym:DeformTransport-v0"
Step = Callable[[], None]


@dataclass(frozen=True, kw_only=True)
class ThroughputConfig:
    """What to measure."""

    num_envs: tuple[int, ...] = (1, 64, 256, 4096)
    """Batch sizes of ``make_vec``."""
    control_mode: Literal["task", "force"] = "task"
    """Control mode of the environment."""
    segments: int = 1
    """Segments of the beam."""
    num_threads: int = 2
    """Physics threads, the same for anchor and environment."""
    rounds: int = 5
    """How often every candidate takes its turn."""
    turn_s: float = 0.5
    """Least time of a turn."""
    outside: bool = True
    """Also time process-parallel and Gymnasium's own environments."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Something to time.

    Attributes:
        name: for the table.
        num_envs: environment steps per call.
        step: one call.
        anchor: name of what it is compared with.
    """

    name: str
    num_envs: int
    step: Step
    anchor: str


def main(config: ThroughputConfig) -> None:
    """Measure and print."""
    candidates, closers = [], []
    for count in config.num_envs:
        candidates += _batched(config, count)
    if config.outside:
        outside, closers = _outside(config)
        candidates += outside
    rates = _rates(candidates, config)
    for close in closers:
        close()
    table = Table(title=f"{config.control_mode} mode, {config.segments} segment(s)")
    for heading in ("candidate", "env steps/s", "of its anchor", "spread", "µs beyond anchor"):
        table.add_column(heading, justify="left" if heading == "candidate" else "right")
    for candidate in candidates:
        own, anchor = rates[candidate.name], rates[candidate.anchor]
        ratios = own / anchor
        beyond = 1e6 * candidate.num_envs * np.median(1 / own - 1 / anchor)
        table.add_row(
            candidate.name,
            f"{np.median(own):,.0f}",
            f"{np.median(ratios):.3f} of {candidate.anchor}",
            f"{ratios.min():.3f}-{ratios.max():.3f}",
            f"{beyond:,.0f}" if candidate.num_envs == 1 else "",
        )
    Console(width=140).print(table)


def _batched(config: ThroughputConfig, count: int) -> list[Candidate]:
    """Return the physics alone and the environment for one batch size."""
    env = DeformTransportVectorEnv(
        count,
        control_mode=config.control_mode,
        beam=BeamParams(segment_count=config.segments),
        num_threads=config.num_threads,
    )
    env.reset(seed=0)
    simulation = env.engine.simulation
    physics = batch.Batch(simulation.model, count, nthread=min(count, config.num_threads))
    substeps = env.config.task.substeps
    actions = _StoredActions(env.single_action_space.shape, count)
    return [
        Candidate(
            name=f"physics n={count}",
            num_envs=count,
            step=lambda: physics.step(nstep=substeps),
            anchor=f"physics n={count}",
        ),
        Candidate(
            name=f"make_vec n={count}",
            num_envs=count,
            step=lambda: env.step(next(actions)),
            anchor=f"physics n={count}",
        ),
    ]


def _outside(config: ThroughputConfig) -> tuple[list[Candidate], list[Callable[[], None]]]:
    """Return the single environment, process-parallel ones, and Gymnasium's own for scale."""
    options = {"control_mode": config.control_mode}
    single = gymnasium.make(ENV_ID, **options)
    marks = {
        name: gymnasium.make(f"{name}-v5") for name in ("HalfCheetah", "InvertedDoublePendulum")
    }
    vectors = {
        f"{mode} 8": gymnasium.make_vec(ENV_ID, num_envs=8, vectorization_mode=mode, **options)
        for mode in ("sync", "async")
    }
    singles = {"single env": single, **marks}
    candidates = [
        Candidate(name=name, num_envs=1, step=_single_step(env), anchor="single env")
        for name, env in singles.items()
    ]
    for name, vector in vectors.items():
        vector.reset(seed=0)
        actions = _StoredActions(vector.single_action_space.shape, 8)
        candidates.append(
            Candidate(
                name=name,
                num_envs=8,
                step=lambda vector=vector, actions=actions: vector.step(next(actions)),
                anchor="single env",
            )
        )
    return candidates, [env.close for env in (*singles.values(), *vectors.values())]


def _single_step(env: gymnasium.Env) -> Step:
    env.reset(seed=0)
    actions = _StoredActions(env.action_space.shape, None)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return step


class _StoredActions:
    """Stored random actions, over and over: sampling a space costs as much as a step."""

    def __init__(self, shape: tuple[int, ...], count: int | None) -> None:
        size = (64, *shape) if count is None else (64, count, *shape)
        self._stored = np.random.default_rng(0).uniform(-1, 1, size)
        self._index = 0

    def __next__(self) -> np.ndarray:
        self._index = (self._index + 1) % 64
        return self._stored[self._index]


def _rates(candidates: Sequence[Candidate], config: ThroughputConfig) -> dict[str, np.ndarray]:
    """Return env steps per second of each round."""
    rates: dict[str, list[float]] = {candidate.name: [] for candidate in candidates}
    for candidate in candidates:
        candidate.step()
    for _ in range(config.rounds):
        for candidate in candidates:
            begin, calls = time.perf_counter(), 0
            while (elapsed := time.perf_counter() - begin) < config.turn_s:
                candidate.step()
                calls += 1
            rates[candidate.name].append(calls * candidate.num_envs / elapsed)
    return {name: np.array(values) for name, values in rates.items()}


if __name__ == "__main__":
    main(tyro.cli(ThroughputConfig, description=__doc__))
