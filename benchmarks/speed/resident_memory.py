"""Resident memory of this process, and what the batched environment needs per episode.

python benchmarks/speed/resident_memory.py --num-envs 4096 --control-mode force
"""

from __future__ import annotations

import gc
import json
import resource
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import tyro


@dataclass(frozen=True, kw_only=True)
class MemoryConfig:
    """What to build."""

    num_envs: int = 4096
    """Batch size."""
    control_mode: Literal["task", "force"] = "task"
    """Control mode of the environment."""
    num_threads: int = 2
    """Physics threads."""


def resident_mib() -> float:
    """Return the resident memory of this process, MiB (its peak where /proc is missing)."""
    status = Path("/proc/self/status")
    if status.exists():
        lines = status.read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024 * 1024 if sys.platform == "darwin" else 1024)


def memory_per_env_kib(config: MemoryConfig) -> dict[str, float]:
    """Return the growth per episode when built, and when it has been reset and stepped, KiB.

    A batch of one is built, reset and stepped first: imports and compiled code do not count.
    Exact only in a fresh process: see ``measured_in_subprocess``.
    """
    from environments import batched_env

    options = {"num_threads": config.num_threads, "control_mode": config.control_mode}
    first = batched_env(1, **options)
    first.reset(seed=0)
    first.step(np.zeros(first.action_space.shape))
    gc.collect()
    before = resident_mib()
    env = batched_env(config.num_envs, **options)
    gc.collect()
    built = resident_mib()
    env.reset(seed=0)
    actions = np.zeros(env.action_space.shape)
    for _ in range(3):
        env.step(actions)
    gc.collect()
    used = resident_mib()
    scale = 1024 / config.num_envs
    return {"built": (built - before) * scale, "reset and stepped": (used - before) * scale}


def measured_in_subprocess(num_envs: int, control_mode: str, num_threads: int) -> dict[str, float]:
    """Return ``memory_per_env_kib`` of a fresh process."""
    words = ["--num-envs", num_envs, "--control-mode", control_mode, "--num-threads", num_threads]
    ended = subprocess.run(
        [sys.executable, __file__, *map(str, words)], capture_output=True, text=True, check=True
    )
    return json.loads(ended.stdout.splitlines()[-1])


if __name__ == "__main__":
    print(json.dumps(memory_per_env_kib(tyro.cli(MemoryConfig, description=__doc__))))
