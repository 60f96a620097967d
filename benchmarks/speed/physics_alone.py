"""The plant's physics without an environment, kept in states that an environment visits.

Forces are random within the actuator limits, as random actions in ``force`` mode give them, and
all simulations start anew before they run away: none may diverge, which ``close`` checks.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from turns import Candidate

Array = NDArray[np.float64]

# About the length of an episode under random forces.
_CALLS_BETWEEN_STARTS = 16


class PlantMotion:
    """Start positions and forces for n simulations of the plant.

    Args:
        config: the environment's definition.
        num_envs: n.
    """

    def __init__(self, config: TransportConfig, num_envs: int) -> None:
        generator = np.random.default_rng(0)
        limits = np.array(config.robot.force_limits)
        start = config.task.start
        starts = np.array(start.center) + np.array(start.spread) * generator.uniform(
            -1, 1, (num_envs, 6)
        )
        joints, swing = starts[:, 3:5], starts[:, 5:]
        hinges = np.zeros((num_envs, config.beam.segment_count))
        hinges[:, :1] = swing - joints.sum(axis=1, keepdims=True)
        self.positions = np.concatenate((starts[:, :5], hinges), axis=1)
        self.forces = limits * generator.uniform(
            -1, 1, (_CALLS_BETWEEN_STARTS, num_envs, len(limits))
        )
        self._calls = 0

    def advance(self) -> tuple[bool, Array]:
        """Return whether the simulations start anew, and the forces of the next call."""
        index = self._calls % _CALLS_BETWEEN_STARTS
        self._calls += 1
        return index == 0, self.forces[index]


def batched_physics(name: str, env: Any, *, num_threads: int) -> Candidate:
    """Return ``Batch.step(nstep)`` on the model of a batched environment: the limit of its speed.

    Args:
        name: of the candidate.
        env: the batched environment.
        num_threads: as the environment's.
    """
    config, model, count = env.config, env.engine.simulation.model, env.num_envs
    motion = PlantMotion(config, count)
    physics = batch.Batch(model, count, nthread=min(count, num_threads))
    position, velocity, control = (physics.bind(field) for field in ("qpos", "qvel", "ctrl"))
    substeps = config.task.substeps
    diverged = 0

    def prepare() -> None:
        nonlocal diverged
        anew, forces = motion.advance()
        if anew:
            diverged += _divergences(physics.warning[..., 1])
            physics.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
            physics.warning[:] = 0
            position[:], velocity[:] = motion.positions, 0.0
        control[:, : forces.shape[1]] = forces

    def close() -> None:
        _require_none(name, diverged + _divergences(physics.warning[..., 1]))

    return Candidate(
        name=name,
        num_envs=count,
        prepare=prepare,
        step=lambda: physics.step(nstep=substeps),
        close=close,
    )


def one_core_physics(name: str, env: Any) -> Candidate:
    """Return ``mj_step(nstep)`` over an MjData for each simulation, one after the other."""
    config, model, count = env.config, env.engine.simulation.model, env.num_envs
    motion = PlantMotion(config, count)
    simulations = [mujoco.MjData(model) for _ in range(count)]
    substeps, mj_step = config.task.substeps, mujoco.mj_step
    diverged = 0

    def counted() -> int:
        return sum(
            _divergences(np.array([warning.number for warning in data.warning]))
            for data in simulations
        )

    def prepare() -> None:
        nonlocal diverged
        anew, forces = motion.advance()
        if anew:
            diverged += counted()
            for data, position in zip(simulations, motion.positions, strict=True):
                mujoco.mj_resetData(model, data)
                data.qpos[:] = position
        for data, force in zip(simulations, forces, strict=True):
            data.ctrl[: len(force)] = force

    def step() -> None:
        for data in simulations:
            mj_step(model, data, substeps)

    return Candidate(
        name=name,
        num_envs=count,
        prepare=prepare,
        step=step,
        close=lambda: _require_none(name, diverged + counted()),
    )


def _divergences(counts: NDArray[Any]) -> int:
    """Return how many of MuJoCo's warning counts, (..., kinds), tell of a diverged state."""
    kinds = mujoco.mjtWarning
    bad = [kinds.mjWARN_BADQPOS.value, kinds.mjWARN_BADQVEL.value, kinds.mjWARN_BADQACC.value]
    return int(counts[..., bad].sum())


def _require_none(name: str, diverged: int) -> None:
    if diverged:
        raise RuntimeError(f"{name}: {diverged} simulations diverged; the comparison is unfair.")
