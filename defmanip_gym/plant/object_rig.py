"""Objects on the rig, shaken in batches by grasp accelerations and yaw rates."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.plant.divergence import DivergenceSentinel
from defmanip_gym.plant.forks import new_batch
from defmanip_gym.plant.rig_model import CARRIAGE_JOINTS, RigModel

Array = NDArray[np.float64]
_CARRIAGE = len(CARRIAGE_JOINTS)
_RECORDED_STEPS = 2000  # keeps a recording of 64 simulations of a long beam below 20 MB

# (time s, z2 (n, N), ż2 (n, N)) → inputs (n, 4): a_x, a_y, a_z m/s² and yaw rate rad/s
Command = Callable[[float, Array, Array], Array]


@dataclass(frozen=True, kw_only=True)
class Shaking:
    """What a batch of shaken objects did; n simulations, N internal coordinates.

    Attributes:
        peak: max over time of |z2|, (n, N).
        diverged: whether MuJoCo gave up on a simulation, (n,); its peak means nothing then.
        inputs: (n, steps, 4) as imposed, or None if not recorded.
        z2: (n, steps, N) after each step, or None if not recorded.
    """

    peak: Array
    diverged: NDArray[np.bool_]
    inputs: Array | None = None
    z2: Array | None = None


class ObjectRig:
    """n copies of an object, each at a grasp that is moved at will.

    Inputs are the grasp's inertial acceleration in its yawing frame (forward, left, up) in m/s² and
    the yaw rate in rad/s; each holds for a step. Objects start at their equilibrium.

    Args:
        rig: the compiled rig.
        count: number of simulations n.
        num_threads: 0 for one per CPU.
    """

    def __init__(self, rig: RigModel, *, count: int, num_threads: int = 0) -> None:
        self.rig, self.count = rig, count
        self.timestep_s = float(rig.model.opt.timestep)
        threads = min(count, num_threads or os.cpu_count() or 1)
        self._batch = new_batch(rig.model, count, threads)
        self._sentinel = DivergenceSentinel(self._batch)
        self._position: Array = self._batch.bind("qpos")
        self._velocity: Array = self._batch.bind("qvel")
        self._control: Array = self._batch.bind("ctrl")
        self._to_joints = np.linalg.inv(rig.read_out)
        self._yaw = CARRIAGE_JOINTS.index("carriage_yaw")
        self.place()

    def place(self, z2: Array | None = None, z2_rate: Array | None = None) -> None:
        """Start anew with the grasp at rest; z2 (n, N), by default at equilibrium and at rest."""
        self._batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self._sentinel.arm(np.arange(self.count))
        start = self.rig.equilibrium if z2 is None else z2
        self._position[:, _CARRIAGE:] = start @ self._to_joints.T
        self._velocity[:] = 0.0
        if z2_rate is not None:
            self._velocity[:, _CARRIAGE:] = z2_rate @ self._to_joints.T

    @property
    def z2(self) -> Array:
        """Internal coordinates, (n, N)."""
        return self._position[:, _CARRIAGE:] @ self.rig.read_out.T

    @property
    def z2_rate(self) -> Array:
        """Their rates, (n, N)."""
        return self._velocity[:, _CARRIAGE:] @ self.rig.read_out.T

    def accelerations(self, inputs: Array) -> Array:
        """Return z̈2 (n, N) that ``inputs`` (n, 4) cause now; yaw is at the rate given."""
        self._velocity[:, self._yaw] = inputs[:, 3]
        self._control[:] = inputs
        self._control[:, 3] = 0.0
        acceleration = self._batch.bind("qacc")
        self._batch.forward()
        return acceleration[:, _CARRIAGE:] @ self.rig.read_out.T

    @property
    def grasp_velocity_b(self) -> Array:
        """Of the grasp, (n, 3) m/s: forward, left, up."""
        yaw, velocity = self._position[:, self._yaw], self._velocity[:, :3]
        forward = np.cos(yaw) * velocity[:, 0] + np.sin(yaw) * velocity[:, 1]
        left = np.cos(yaw) * velocity[:, 1] - np.sin(yaw) * velocity[:, 0]
        return np.stack((forward, left, velocity[:, 2]), axis=1)

    @property
    def yaw(self) -> Array:
        """θ of the grasp, (n,) rad."""
        return self._position[:, self._yaw].copy()

    @property
    def yaw_rate(self) -> Array:
        """u2, (n,) rad/s."""
        return self._velocity[:, self._yaw].copy()

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Where MuJoCo has given up on a simulation, (n,)."""
        return self._sentinel.diverged

    @property
    def grasp_velocity_w(self) -> Array:
        """The same in world axes, (n, 3) m/s."""
        return self._velocity[:, :3].copy()

    def move(self, velocity_w: Array, yaw_rate: Array) -> None:
        """Let grasps move and turn from now on, (n, 3) m/s in world axes and (n,) rad/s."""
        self._velocity[:, :3], self._velocity[:, self._yaw] = velocity_w, yaw_rate

    def push(self, accelerations: Array, *, steps: int) -> Array:
        """Hold accelerations for some steps; return max |z2| on the way, (n, N).

        Args:
            accelerations: of the grasp in its yawing frame, m/s², and of the yaw, rad/s², (n, 4).
            steps: physics steps.
        """
        self._control[:] = accelerations
        peak = np.abs(self.z2)
        for _ in range(steps):
            self._batch.step(nstep=1)
            np.maximum(peak, np.abs(self.z2), out=peak)
        return peak

    def shake(
        self, command: Command, *, duration_s: float, hold_steps: int = 1, record: bool = False
    ) -> Shaking:
        """Shake by feedback: ``command`` is asked every ``hold_steps`` steps."""
        step_s = hold_steps * self.timestep_s
        steps = round(duration_s / step_s)
        peak = np.abs(self.z2)
        inputs = np.empty((steps if record else 0, self.count, 4))
        trajectory = np.empty((steps if record else 0, self.count, self.rig.count))
        for index in range(steps):
            z2 = self.z2
            wanted = command(index * step_s, z2, self.z2_rate)
            # a jump of the yaw rate is a change of state, not a force that acts over a step
            self._velocity[:, self._yaw] = wanted[:, 3]
            self._control[:, :3] = wanted[:, :3]
            self._batch.step(nstep=hold_steps)
            reached = self.z2
            np.maximum(peak, np.abs(reached), out=peak)
            if record:
                inputs[index], trajectory[index] = wanted, reached
        return Shaking(
            peak=peak,
            diverged=self._sentinel.diverged,
            inputs=inputs.swapaxes(0, 1).repeat(hold_steps, axis=1) if record else None,
            z2=trajectory.swapaxes(0, 1) if record else None,
        )

    def play(self, inputs: Array, *, scale: Array | None = None, record: bool = False) -> Shaking:
        """Shake open loop.

        Args:
            inputs: (n, steps, 4), or (1, steps, 4) for the same in all simulations.
            scale: (n, 4) factors of the inputs by simulation.
            record: whether to return the trajectory of z2.
        """
        steps = inputs.shape[1]
        peak = np.abs(self.z2)
        pieces = []
        for begin in range(0, steps, _RECORDED_STEPS):
            held = inputs[:, begin : begin + _RECORDED_STEPS]
            if scale is not None:
                held = held * scale[:, None, :]
            control = np.array(np.broadcast_to(held, (self.count, *held.shape[1:])))
            self._difference_yaw(control)
            positions = self._batch.rollout(control.shape[1], control, record=("qpos",))["qpos"]
            z2 = positions[:, :, _CARRIAGE:] @ self.rig.read_out.T
            np.maximum(peak, np.abs(z2).max(axis=1), out=peak)
            if record:
                pieces.append(z2)
        return Shaking(
            peak=peak,
            diverged=self._sentinel.diverged,
            inputs=inputs if record else None,
            z2=np.concatenate(pieces, axis=1) if record else None,
        )

    def _difference_yaw(self, control: Array) -> None:
        """Turn the yaw rates of a sequence into the accelerations that bring them about."""
        if not control[..., 3].any() and not self._velocity[:, self._yaw].any():
            return
        rates = np.concatenate((self._velocity[:, None, self._yaw], control[..., 3]), axis=1)
        control[..., 3] = np.diff(rates, axis=1) / self.timestep_s
