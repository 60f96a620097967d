"""Robots of which only the motion is there, carrying objects on the rig.

What the environment does to an object and observes of it, without a robot's errors: the unicycle
with its arm moves by redundancy resolution and speed limit, without forces, and the rig's carriage
follows its grasp. Observations are those of ``ObservationLayout(N)`` with z2 as ``swing``; goal,
force and what else filters do not look at stay zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.observation import ObservationLayout
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height, reach_and_height_slopes
from defmanip_gym.theory.filters.batches import drive_all
from defmanip_gym.theory.filters.limits import RobotLimits
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.validation import require_array


class RigRobot:
    """n robots that carry the objects of a rig.

    Args:
        rig: with n objects.
        limits: of the robots, with their control period.
    """

    def __init__(self, rig: ObjectRig, limits: RobotLimits) -> None:
        self.rig, self._limits = rig, limits
        self._count, self._segments = rig.count, rig.rig.count
        self._steps = max(round(limits.period_s / rig.timestep_s), 1)
        self.layout = ObservationLayout(self._segments)
        self._state = Sensed.empty(self._count, self._segments)
        self._halted = np.zeros(self._count, dtype=bool)
        self.peak = np.zeros((self._count, self._segments))

    def place(
        self, pitch: Array, z2: Array, z2_rate: Array, *, velocity_b: Array | None = None
    ) -> Array:
        """Start with arms at pitches (n, 2) rad and objects at z2, ż2 (n, N); return observations.

        Args:
            pitch: α of the arms.
            z2: of the objects.
            z2_rate: their rates.
            velocity_b: of the grasps forward and left, (n, 2) m/s; at rest by default. Bases turn
                as they have to for what is leftward.
        """
        n, N = self._count, self._segments
        state = self._state
        state.pitch[:] = require_array("pitch", pitch, (n, 2))
        state.pitch_rate[:] = 0.0
        self._halted[:] = False
        self._pitch_at_start = state.pitch.copy()
        self.rig.place(require_array("z2", z2, (n, N)), require_array("z2_rate", z2_rate, (n, N)))
        velocity = np.zeros((n, 3))
        if velocity_b is not None:
            velocity[:, :2] = require_array("velocity_b", velocity_b, (n, 2))
        self.rig.move(velocity, velocity[:, 1] / self._reach())
        self._read()
        self.peak[:] = np.abs(z2)
        return self.observation()

    def step(self, command_m_s2: Array, beside_m_s2: Array) -> Array:
        """Carry out commands (n, 3) for a period, with errors beside them; return observations."""
        motions = np.empty((self._count, 4))
        n = self._count
        commands = require_array("command_m_s2", command_m_s2, (n, 3))
        beside = require_array("beside_m_s2", beside_m_s2, (n, 3))
        drive_all(self._limits, commands, beside, self._state, motions)
        # wheels do not slip: at the period's end the yaw rate is what the leftward speed asks for
        later = self._state.velocity_b[:, 1] / self._reach()
        motions[:, 3] = (later - self.rig.yaw_rate) / self._limits.period_s
        motions[self._halted] = 0.0
        self.peak = self.rig.push(motions, steps=self._steps)
        self._read()
        return self.observation()

    def halt(self, where: NDArray[np.bool_]) -> None:
        """Let robots stand still from now on, (n,), whatever is commanded."""
        self._halted |= where
        velocity, yaw_rate = self.rig.grasp_velocity_w, self.rig.yaw_rate
        velocity[self._halted], yaw_rate[self._halted] = 0.0, 0.0
        self.rig.move(velocity, yaw_rate)
        self._state.pitch[self._halted] = self._pitch_at_start[self._halted]
        self._state.pitch_rate[self._halted] = 0.0

    @property
    def pitch(self) -> Array:
        """α of the arms, (n, 2) rad."""
        return self._state.pitch.copy()

    def observation(self) -> Array:
        """Return what is observed, (n, size)."""
        rows, state, part = np.zeros((self._count, self.layout.size)), self._state, self.layout.part
        part(rows, "heading")[:] = np.stack((np.sin(state.heading), np.cos(state.heading)), axis=1)
        part(rows, "grasp_velocity_b")[:] = state.velocity_b
        part(rows, "base_velocity")[:] = state.base_velocity
        part(rows, "joints")[:, 0] = state.pitch[:, 0]
        part(rows, "joints")[:, 1] = state.pitch[:, 1] - state.pitch[:, 0]
        part(rows, "joint_rates")[:, 0] = state.pitch_rate[:, 0]
        part(rows, "joint_rates")[:, 1] = state.pitch_rate[:, 1] - state.pitch_rate[:, 0]
        part(rows, "swing")[:], part(rows, "swing_rate")[:] = self.rig.z2, self.rig.z2_rate
        return rows

    def _read(self) -> None:
        """Take the grasp's motion from the rig, and the base's from the grasp's."""
        state, rates = self._state, self._state.pitch_rate
        state.velocity_b[:], state.heading[:] = self.rig.grasp_velocity_b, self.rig.yaw
        upper, fore, _, _ = reach_and_height_slopes(self._limits.arm, *state.pitch.T)
        state.base_velocity[:, 0] = (
            state.velocity_b[:, 0] - upper * rates[:, 0] - fore * rates[:, 1]
        )
        state.base_velocity[:, 1] = self.rig.yaw_rate

    def _reach(self) -> Array:
        reach: Array = reach_and_height(self._limits.arm, *self._state.pitch.T)[0]
        return reach
