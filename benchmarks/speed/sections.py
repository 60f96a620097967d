"""The sections of the throughput benchmark: which candidates meet, and which ratios matter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import gymnasium

from defmanip_gym.params import BeamParams
from environments import (
    ENV_ID,
    batched_env,
    sb3_candidate,
    single_candidate,
    single_makers,
    vector_candidate,
)
from envpool_cheetah import NAME as ENVPOOL_NAME
from envpool_cheetah import envpool_cheetah
from marks import beyond_physics
from physics_alone import batched_physics, one_core_physics
from resident_memory import measured_in_subprocess
from turns import Candidate, Figure, Times, take_turns

ControlMode = Literal["task", "force"]
Section = Literal["batch", "vector", "core", "segments", "marks", "memory", "envpool"]

_BATCH = 256


@dataclass(frozen=True, kw_only=True)
class ThroughputConfig:
    """What to measure."""

    sections: tuple[Section, ...] = (
        "batch",
        "vector",
        "core",
        "segments",
        "marks",
        "memory",
        "envpool",
    )
    """What to run, in this order."""
    num_envs: tuple[int, ...] = (1, 8, 64, 256, 1024, 4096)
    """Batch sizes of ``make_vec`` in the section batch."""
    control_modes: tuple[ControlMode, ...] = ("task", "force")
    """Control modes of the environment."""
    constraint_mode: Literal["terminate", "penalty", "cost"] = "terminate"
    """Constraint mode of the environment: random forces end an episode in about 14 steps."""
    segment_counts: tuple[int, ...] = (1, 4, 16)
    """Segments of the beam in the section segments; ratios refer to the first."""
    workers: int = 8
    """Single environments, or processes, in other vector environments in the section vector."""
    memory_envs: int = 4096
    """Batch size in the section memory."""
    num_threads: int = 2
    """Physics threads, the same for all candidates."""
    rounds: int = 7
    """How often every candidate takes its turn."""
    turn_s: float = 0.2
    """Least time of a turn."""
    json: Path | None = None
    """Also write all figures there."""

    def take_turns(self, candidates: list[Candidate]) -> Times:
        """Time candidates with the configured rounds."""
        return take_turns(candidates, rounds=self.rounds, turn_s=self.turn_s)

    def batched_env(self, num_envs: int, control_mode: str, **options: Any) -> Any:
        """Return ``make_vec`` with the configured threads and constraint mode."""
        return batched_env(
            num_envs,
            num_threads=self.num_threads,
            control_mode=control_mode,
            constraint_mode=self.constraint_mode,
            **options,
        )


def batch_section(config: ThroughputConfig) -> list[Figure]:
    """``make_vec`` against ``Batch.step`` alone, for each n."""
    figures = []
    for count in config.num_envs:
        limit = f"physics n={count}"
        envs = {mode: config.batched_env(count, mode) for mode in config.control_modes}
        candidates = [
            batched_physics(limit, next(iter(envs.values())), num_threads=config.num_threads)
        ]
        names = {mode: f"make_vec n={count} {mode}" for mode in envs}
        candidates += [vector_candidate(names[mode], env) for mode, env in envs.items()]
        times = config.take_turns(candidates)
        figures.append(times.rate(limit))
        for name in names.values():
            figures += [times.rate(name), times.speed(name, limit)]
    return figures


def vector_section(config: ThroughputConfig) -> list[Figure]:
    """Ways to step the environment, in its default control mode, against a single one."""
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

    from defmanip_gym.training.sb3_vec_env import Sb3VecEnv

    count, options = config.workers, {"constraint_mode": config.constraint_mode}
    makers = single_makers(count, **options)
    # worker processes are started before any thread of this process
    workers = f"SubprocVecEnv({count})"
    candidates = [sb3_candidate(workers, SubprocVecEnv(makers))]
    for kind in ("async", "sync"):
        vector = gymnasium.make_vec(ENV_ID, count, vectorization_mode=kind, **options)
        candidates.append(vector_candidate(f"{kind.capitalize()}VectorEnv({count})", vector))
    candidates += [
        sb3_candidate(f"DummyVecEnv({count})", DummyVecEnv(makers)),
        single_candidate("single env", gymnasium.make(ENV_ID, **options)),
    ]
    for size in (64, _BATCH):
        for_gymnasium = config.batched_env(size, "task")
        for_sb3 = config.batched_env(size, "task", autoreset_mode="SameStep")
        candidates += [
            vector_candidate(f"make_vec({size})", for_gymnasium),
            sb3_candidate(f"Sb3VecEnv({size})", Sb3VecEnv(for_sb3)),
        ]
    names = [candidate.name for candidate in candidates]
    times = config.take_turns(candidates)
    figures = [times.rate(name) for name in names]
    figures += [times.speed(name, "single env") for name in names if name != "single env"]
    figures += [times.speed(f"Sb3VecEnv({n})", f"make_vec({n})") for n in (64, _BATCH)]
    figures.append(times.speed("make_vec(64)", workers))
    return figures


def core_section(config: ThroughputConfig) -> list[Figure]:
    """The whole environment on all threads against bare ``mj_step`` on one core.

    On two threads the aim is at most 0.70 of that core's time.
    """
    env = config.batched_env(_BATCH, "force")
    alone, limit, whole = "mj_step on one core", "physics", f"make_vec({_BATCH}) force"
    times = config.take_turns(
        [
            one_core_physics(alone, env),
            batched_physics(limit, env, num_threads=config.num_threads),
            vector_candidate(whole, env),
        ]
    )
    return [
        *(times.rate(name) for name in (alone, limit, whole)),
        times.cost(whole, alone),
        times.cost(limit, alone),
        times.cost(whole, limit),
    ]


def segments_section(config: ThroughputConfig) -> list[Figure]:
    """How the cost of a step grows with the beam's segments."""
    figures = []
    first = config.segment_counts[0]
    for mode in config.control_modes:
        candidates = []
        for segments in config.segment_counts:
            env = config.batched_env(_BATCH, mode, beam=BeamParams(segment_count=segments))
            limit = f"physics {mode} N={segments}"
            candidates += [
                vector_candidate(f"{mode} N={segments}", env),
                batched_physics(limit, env, num_threads=config.num_threads),
            ]
        times = config.take_turns(candidates)
        for segments in config.segment_counts:
            name = f"{mode} N={segments}"
            figures += [times.rate(name), times.speed(name, f"physics {name}")]
        for prefix in ("", "physics "):
            for segments in config.segment_counts[1:]:
                name, reference = (f"{prefix}{mode} N={n}" for n in (segments, first))
                figures.append(times.cost(name, reference))
    return figures


def marks_section(config: ThroughputConfig) -> list[Figure]:
    """What a single environment's step costs beyond its physics; see ``marks``."""
    return beyond_physics(
        config.control_modes,
        rounds=config.rounds,
        turn_s=config.turn_s,
        constraint_mode=config.constraint_mode,
    )


def memory_section(config: ThroughputConfig) -> list[Figure]:
    """Resident memory per episode, in a fresh process for each control mode."""
    figures = []
    for mode in config.control_modes:
        growth = measured_in_subprocess(config.memory_envs, mode, config.num_threads)
        for when, value in growth.items():
            name = f"make_vec({config.memory_envs}) {mode}, {when}"
            figures.append(Figure.of(name, [value], "KiB per env"))
    return figures


def envpool_section(config: ThroughputConfig) -> list[Figure]:
    """EnvPool's HalfCheetah against ``make_vec``, per substep and degree of freedom."""
    theirs, ours = f"EnvPool {ENVPOOL_NAME}({_BATCH})", f"make_vec({_BATCH}) force"
    candidate, their_work = envpool_cheetah(theirs, _BATCH, config.num_threads)
    env = config.batched_env(_BATCH, "force")
    our_work = env.config.task.substeps * env.engine.simulation.model.nv
    times = config.take_turns([candidate, vector_candidate(ours, env)])
    work = {theirs: their_work, ours: our_work}
    scaled = Times({name: seconds / work[name] for name, seconds in times.seconds.items()})
    return [
        *(times.rate(name) for name in work),
        *(
            Figure.of(name, 1e-6 / scaled.seconds[name], "million substeps × DoF/s")
            for name in work
        ),
        scaled.speed(ours, theirs),
    ]


SECTIONS: dict[Section, Callable[[ThroughputConfig], list[Figure]]] = {
    "batch": batch_section,
    "vector": vector_section,
    "core": core_section,
    "segments": segments_section,
    "marks": marks_section,
    "memory": memory_section,
    "envpool": envpool_section,
}
