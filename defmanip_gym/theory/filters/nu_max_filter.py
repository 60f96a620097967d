"""``nu_max``: a certificate's bound on the acceleration, whatever the object does (Remark IV.1).

Blind to the object's state, it must hold against resonance: what the paper's idea costs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.certified_command import certified_command
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.frames import base_to_world
from defmanip_gym.theory.dynamics.robot_model import ArmKinematics
from defmanip_gym.theory.filters.safety_filter import (
    BoolArray,
    FilterDecision,
    FilterProof,
    SafetyFilter,
    finite_accelerations,
    require_count,
)
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.validation import plain, require_params


class NuMaxMemory:
    """What the last period showed of n episodes."""

    remembers = ("excess", "before", "command")

    def __init__(self, count: int, segments: int) -> None:
        self.excess = np.zeros((count, 3))  # mean acceleration less command, m/s²
        self.before = Sensed.empty(count, segments)
        self.command = np.zeros((count, 3))


class NuMaxFilter(SafetyFilter):
    """Keeps forward and vertical acceleration and the yaw rate within a certificate.

    What the last period's mean acceleration exceeded its command by is taken off the next command,
    so that only what changes from one period to the next remains an error: the surprise.

    Args:
        certificate: the bounds; or a mapping of its fields.
        robot: whose arm carries the object.
        task: its limits and control period.
    """

    name = "nu_max"

    def __init__(
        self,
        certificate: Certificate,
        *,
        robot: RobotParams = RobotParams(),
        task: TaskParams = TaskParams(),
    ) -> None:
        self.certificate = require_params("certificate", certificate, Certificate)
        self.robot = require_params("robot", robot, RobotParams)
        self.task = require_params("task", task, TaskParams)
        self.sigma_rad = self.certificate.sigma_rad
        self.segment_count = self.certificate.coordinate_count
        self._layout = ObservationLayout(self.segment_count)
        self._kinematics = ArmKinematics(self.robot)

    @property
    def proof(self) -> FilterProof:  # type: ignore[override]
        """For which model of the object the bound is proven."""
        return self.certificate.proof

    @property
    def specification(self) -> dict[str, Any]:
        """What the filter was made with, as JSON values."""
        return {
            "name": self.name,
            "certificate": plain(self.certificate),
            "robot": plain(self.robot),
            "task": plain(self.task),
        }

    def covers(self, carried: object) -> bool:
        """Whether the certificate holds for this beam."""
        return isinstance(carried, BeamParams) and self.certificate.covers(carried)

    def memory(self, count: int) -> NuMaxMemory:
        """Return the memory of n episodes."""
        return NuMaxMemory(count, self.segment_count)

    def begin(self, memory: NuMaxMemory, observation: Array, started: BoolArray) -> None:
        """Let episodes start, (n,): nothing is known of their past."""
        memory.excess[started] = 0.0

    def certify_action(
        self, wished_m_s2: Any, observation: Array, memory: NuMaxMemory
    ) -> FilterDecision:
        """Return the commands nearest to those wished that the certificate allows now, (n, 3).

        The margin is the share of the forward bound that is not used.

        Raises:
            ActionError: accelerations that are not finite or of another shape.
            ParameterError: observations of another size.
        """
        sensed = Sensed.observed(self._layout, observation)
        require_count(len(memory.excess), len(sensed.heading))
        wished = finite_accelerations(wished_m_s2, len(sensed.heading))
        limit = self.task.max_acceleration_m_s2
        command = certified_command(
            wished,
            sensed.velocity_b,
            sensed.base_velocity,
            self._kinematics.reach_and_height(sensed.pitch)[:, 0],
            self.certificate,
            disturbance=memory.excess,
            max_speed=self.task.max_speed_m_s,
            period_s=self.task.control_period_s,
        )
        memory.before, memory.command = sensed, np.clip(command, -limit, limit)
        used = np.abs(memory.command[:, 0] + memory.excess[:, 0])
        margin: Array = 1.0 - used / self.certificate.acceleration_bound
        return FilterDecision(memory.command.copy(), margin)

    def conclude(self, observation: Array, memory: NuMaxMemory) -> Array:
        """Take note of the motion at the end of the period; return the surprises, (n, 3) m/s²."""
        after, before = Sensed.observed(self._layout, observation), memory.before
        require_count(len(memory.excess), len(after.heading))
        earlier = base_to_world(before.velocity_b, before.heading - after.heading)
        gained = (after.velocity_b - earlier) / self.task.control_period_s
        excess = gained - memory.command
        surprise: Array = excess - memory.excess
        memory.excess = excess
        return surprise

    def inside(self, observation: Array, memory: NuMaxMemory) -> BoolArray:
        """Whether the swing is what the certificate provides for at the start, (n,)."""
        swing = np.abs(self._layout.part(observation, "swing")).max(axis=1)
        within: BoolArray = swing <= self.certificate.conditions.initial_swing_rad
        return within
