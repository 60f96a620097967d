"""Batched physics with read-outs in the theory's coordinates."""

from __future__ import annotations

import os
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.builder import build_model

Array = NDArray[np.float64]

# MuJoCo answers a diverged state with a silent reset; only these counters tell.
_DIVERGENCE = [
    mujoco.mjtWarning.mjWARN_BADQPOS.value,
    mujoco.mjtWarning.mjWARN_BADQVEL.value,
    mujoco.mjtWarning.mjWARN_BADQACC.value,
]
_ACCELERATION_STAGE = mujoco.mjtStage.mjSTAGE_ACC.value
_NO_STAGE = mujoco.mjtStage.mjSTAGE_NONE.value


@dataclass(frozen=True, kw_only=True)
class PlantState:
    """What the plant's sensors and encoders see; n simulations, N segments.

    Attributes:
        base_pose: (x, y, θ), (n, 3) m, m, rad, world frame.
        base_velocity: (u1, u2), (n, 2) m/s, rad/s.
        lateral_speed: slip of the base to its left, (n,) m/s.
        joints: q_a, (n, 2) rad.
        joint_rates: q̇_a, (n, 2) rad/s.
        swing: φ, (n, N) rad from the vertical.
        swing_rate: φ̇, (n, N) rad/s.
        grasp_force_b: force on the object at the grasp, (n, 3) N, base frame.
    """

    base_pose: Array
    base_velocity: Array
    lateral_speed: Array
    joints: Array
    joint_rates: Array
    swing: Array
    swing_rate: Array
    grasp_force_b: Array


class Simulation:
    """n copies of the plant, stepped together on a thread pool.

    Args:
        robot: true robot parameters.
        beam: true beam parameters.
        count: number of simulations n.
        goal_position_m: where the goal marker stands, world frame.
        physics_period_s: integration step.
        num_threads: 0 for one per CPU.
    """

    def __init__(
        self,
        robot: RobotParams,
        beam: BeamParams,
        *,
        count: int,
        goal_position_m: tuple[float, float, float],
        physics_period_s: float,
        num_threads: int = 0,
    ) -> None:
        self.model = build_model(
            robot, beam, goal_position_m=goal_position_m, physics_period_s=physics_period_s
        )
        threads = min(count, num_threads or os.cpu_count() or 1)
        self._batch = batch.Batch(self.model, count, nthread=threads)
        self._position: Array = self._batch.bind("qpos")
        self._velocity: Array = self._batch.bind("qvel")
        control: Array = self._batch.bind("ctrl")
        self._control = control[:, : len(names.ACTUATORS)]
        self._lateral_target = control[:, self.model.actuator(names.NO_SLIP).id]
        self._external: Array = self._batch.bind("xfrc_applied")
        self._force: Array = self._batch.bind("sensordata")
        self._forearm = self.model.body(names.FOREARM).id
        self._forearm_com_m = float(self.model.body(names.FOREARM).ipos[0])
        self._forearm_length_m = robot.forearm.length_m
        self._divergences = np.zeros(count, dtype=np.int64)
        self.count = count

    def read(self) -> PlantState:
        """Return copies of the current state and the grasp force at this instant."""
        position, velocity = self._position, self._velocity
        heading = position[:, 2]
        cos, sin = np.cos(heading), np.sin(heading)
        x_dot, y_dot = velocity[:, 0], velocity[:, 1]
        pitch, pitch_rate = position[:, 3:].cumsum(axis=1), velocity[:, 3:].cumsum(axis=1)
        swing = pitch[:, 2:]
        return PlantState(
            base_pose=position[:, :3].copy(),
            base_velocity=np.stack((cos * x_dot + sin * y_dot, velocity[:, 2]), axis=1),
            lateral_speed=cos * y_dot - sin * x_dot,
            joints=position[:, 3:5].copy(),
            joint_rates=velocity[:, 3:5].copy(),
            swing=swing,
            swing_rate=pitch_rate[:, 2:],
            grasp_force_b=_pitched(self._force, swing[:, 0]),
        )

    def place(self, ids: NDArray[np.intp], pose: Array, joints: Array, swing: Array) -> None:
        """Put simulations at rest: ``pose`` (k, 3), ``joints`` (k, 2), ``swing`` (k, N)."""
        self._batch.reset(ids, stage=_NO_STAGE)
        self._batch.warning[ids] = 0
        self._divergences[ids] = 0
        pitch = np.concatenate((joints.sum(axis=1, keepdims=True), swing), axis=1)
        self._position[ids] = np.concatenate((pose, joints, np.diff(pitch, axis=1)), axis=1)
        self._velocity[ids] = 0.0

    def hold(self, ids: NDArray[np.intp], generalized_forces: Array) -> None:
        """Set T_r of simulations, (k, 4), and compute the forces it causes, without stepping."""
        self._control[ids] = generalized_forces
        self._batch.forward(ids)

    def apply(self, generalized_forces: Array) -> None:
        """Set T_r = (f_b, α_b, τ1, τ2), (n, 4); the actuator limits clip it."""
        self._control[:] = generalized_forces

    def push_grasp(self, force_b: Array) -> None:
        """Let a force act on the end effector, (n, 3) N in the base frame, until set anew."""
        heading = self._position[:, 2]
        pitch = self._position[:, 3] + self._position[:, 4]
        cos, sin = np.cos(heading), np.sin(heading)
        force = np.stack(
            (
                cos * force_b[:, 0] - sin * force_b[:, 1],
                sin * force_b[:, 0] + cos * force_b[:, 1],
                force_b[:, 2],
            ),
            axis=1,
        )
        arm = self._forearm_length_m - self._forearm_com_m
        out, up = arm * np.cos(pitch), arm * np.sin(pitch)
        external = self._external[:, self._forearm]
        external[:, :3] = force
        # lever × force by components: np.cross costs more than all the rest
        external[:, 3] = out * sin * force[:, 2] - up * force[:, 1]
        external[:, 4] = up * force[:, 0] - out * cos * force[:, 2]
        external[:, 5] = out * (cos * force[:, 1] - sin * force[:, 0])

    def step(self, substeps: int) -> NDArray[np.bool_]:
        """Advance all simulations; return which of them diverged, (n,).

        A simulation that diverged holds a meaningless state until it is placed again.
        """
        failed = np.zeros(self.count, dtype=bool)
        # the no-slip force acts along the axle at the start of a step, and the base has turned by
        # u2 h at its end: without this lead it would slip by u1 u2 h, 5 mm/s at 1 m/s and 1 rad/s
        heading, velocity = self._position[:, 2], self._velocity
        forward = np.cos(heading) * velocity[:, 0] + np.sin(heading) * velocity[:, 1]
        self._lateral_target[:] = forward * velocity[:, 2] * self.model.opt.timestep
        try:
            # the extra stage makes the force that of this instant, not of one substep ago
            self._batch.step(nstep=substeps, stage=_ACCELERATION_STAGE)
        except batch.SimulationError as error:
            failed[error.ids] = True
        divergences = self._batch.warning[:, _DIVERGENCE, 1].sum(axis=1)
        failed |= divergences > self._divergences
        self._divergences[:] = divergences
        return failed

    def materialize(self, index: int, data: mujoco.MjData) -> None:
        """Write one simulation's state into ``data`` and complete it, for rendering."""
        self._batch.get_data(index, data)
        mujoco.mj_forward(self.model, data)


def _pitched(force_s: Array, swing: Array) -> Array:
    """Turn forces from the first segment's frame, pitched by its swing, into the base frame."""
    cos, sin = np.cos(swing), np.sin(swing)
    return np.stack(
        (
            cos * force_s[:, 0] - sin * force_s[:, 2],
            force_s[:, 1],
            sin * force_s[:, 0] + cos * force_s[:, 2],
        ),
        axis=1,
    )
