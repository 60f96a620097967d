"""Random soak: many steps in every mode, with everything watched that must never happen.

Environments of all modes stand side by side and take turns, so that memory must stay flat once
each has had some; actions are uniform or held at their limits. Fails where an observation, reward
or info is not finite, memory grows, or MuJoCo writes to the standard error stream or its log file.
Failed simulations are counted: they are an outcome, reported in ``info``.

    python benchmarks/speed/soak.py
    python benchmarks/speed/soak.py --steps 1_000_000 --num-envs 64
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console

from defmanip_gym.display import progress_bar
from defmanip_gym.params import BeamParams, DisturbanceParams
from environments import batched_env
from file_descriptors import captured_stderr
from resident_memory import resident_mib

Array = NDArray[np.float64]

DISTURBANCE = DisturbanceParams(
    force_amplitude_n=5.0,
    force_bias_n=0.5,
    force_sensor_noise_n=0.1,
    swing_sensor_noise_rad=0.001,
)

MUJOCO_LOG = "MUJOCO_LOG.TXT"

# Control periods for which an action at its limits is held.
_HELD_PERIODS = 10


@dataclass(frozen=True, kw_only=True)
class SoakConfig:
    """How long, and what counts as a failure."""

    steps: int = 10_000_000
    """Environment steps, over all environments together."""
    num_envs: int = 256
    """Batch size of each environment."""
    segment_counts: tuple[int, ...] = (1, 4, 16)
    """Segments of the beam."""
    num_threads: int = 2
    """Physics threads."""
    stretch: int = 50
    """Control periods of one environment before the next takes its turn."""
    warm_up_cycles: int = 2
    """Turns of every environment before memory is watched."""
    max_growth_mib: float = 16.0
    """Largest growth of the resident memory after that."""
    seed: int = 0
    """Seed of starts and actions."""


@dataclass(kw_only=True)
class SoakReport:
    """What the soak saw.

    Attributes:
        steps: environment steps made.
        episodes: episodes that ended.
        failed_simulations: of them, those whose simulation diverged.
        growth_mib: largest growth of the resident memory after the warm-up; NaN without one.
        seconds: of wall-clock time.
        problems: one line each; none in a passed soak.
    """

    steps: int = 0
    episodes: int = 0
    failed_simulations: int = 0
    growth_mib: float = float("nan")
    seconds: float = 0.0
    problems: list[str]


def soak(config: SoakConfig, console: Console | None = None) -> SoakReport:
    """Step all environments in turn until ``config.steps`` or the first value that is not finite.

    Args:
        config: see there.
        console: where to show progress, if anywhere.
    """
    report = SoakReport(problems=[])
    log = Path(MUJOCO_LOG)
    log_size = _size(log)
    begin = time.perf_counter()
    with captured_stderr() as written:
        _run(config, report, console)
        lines = written.read_text(errors="replace").splitlines()
    report.seconds = time.perf_counter() - begin
    if report.growth_mib > config.max_growth_mib:
        report.problems.append(
            f"memory grew by {report.growth_mib:.1f} MiB, more than {config.max_growth_mib:g}"
        )
    if lines:
        report.problems.append(f"standard error got {len(lines)} lines, first: {lines[0]}")
    if _size(log) != log_size:
        report.problems.append(f"{MUJOCO_LOG} was written in {Path.cwd()}")
    return report


def not_finite(values: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """Yield the names of arrays that hold NaN or infinity, those in nested mappings too."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from not_finite(value, f"{prefix}{name}.")
        elif not np.isfinite(np.asarray(value, dtype=np.float64)).all():
            yield f"{prefix}{name}"


def _run(config: SoakConfig, report: SoakReport, console: Console | None) -> None:
    generator = np.random.default_rng(config.seed)
    envs = _environments(config)
    console = console or Console(quiet=True)
    settled = float("nan")
    with progress_bar(console) as progress:
        line = progress.add_task("soak", total=config.steps)
        cycle = 0
        while True:
            for name, env in envs.items():
                for actions in _actions(env, config.stretch, generator):
                    found = _step(env, actions, report)
                    if found:
                        report.problems.append(f"{name}: not finite: {', '.join(found)}")
                    if found or report.steps >= config.steps:
                        return
                if cycle >= config.warm_up_cycles:
                    report.growth_mib = np.fmax(report.growth_mib, resident_mib() - settled)
                progress.update(line, completed=report.steps)
            cycle += 1
            if cycle == config.warm_up_cycles:
                settled = resident_mib()


def _environments(config: SoakConfig) -> dict[str, Any]:
    """Return started environments by name, each with and without disturbance."""
    envs = {}
    settings = product(
        config.segment_counts, ("task", "force"), ("terminate", "penalty", "cost"), (False, True)
    )
    for segments, control, constraint, disturbed in settings:
        name = f"{control}, {constraint}, N={segments}{', disturbed' if disturbed else ''}"
        env = batched_env(
            config.num_envs,
            num_threads=config.num_threads,
            control_mode=control,
            constraint_mode=constraint,
            beam=BeamParams(segment_count=segments),
            disturbance=DISTURBANCE if disturbed else DisturbanceParams(),
        )
        env.reset(seed=config.seed)
        envs[name] = env
    return envs


def _actions(env: Any, count: int, generator: np.random.Generator) -> Iterator[Array]:
    """Yield actions of a stretch: uniform, or held at their limits for a while."""
    shape = env.action_space.shape
    held = generator.random() < 0.5
    limits = np.zeros(shape)
    for index in range(count):
        if held and index % _HELD_PERIODS == 0:
            limits = generator.choice((-1.0, 1.0), shape)
        yield limits if held else generator.uniform(-1, 1, shape)


def _step(env: Any, actions: Array, report: SoakReport) -> list[str]:
    """Step once, count, and return the names of what is not finite."""
    observation, reward, terminated, truncated, info = env.step(actions)
    report.steps += env.num_envs
    report.episodes += int((terminated | truncated).sum())
    last = info.get("final_info", info)
    report.failed_simulations += int(last["simulation_failed"].sum())
    return list(not_finite({"observation": observation, "reward": reward, "info": info}))


def _size(path: Path) -> int | None:
    return path.stat().st_size if path.exists() else None


def main(config: SoakConfig) -> int:
    """Run, print the report and return the exit code."""
    console = Console()
    warnings.filterwarnings("ignore", message=".*out of date")  # v0 beside v1
    report = soak(config, console)
    watched = not math.isnan(report.growth_mib)
    growth = f"grew by {report.growth_mib:.1f} MiB" if watched else "was not watched: no step"
    console.print(
        f"{report.steps:,} env steps in {report.seconds:.0f} s, {report.episodes:,} episodes, "
        f"{report.failed_simulations:,} failed simulations; memory {growth} after the warm-up"
    )
    for problem in report.problems:
        console.print(f"FAILED: {problem}", style="red", markup=False)
    return 1 if report.problems else 0


if __name__ == "__main__":
    sys.exit(main(tyro.cli(SoakConfig, description=__doc__)))
