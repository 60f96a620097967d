"""Robot, beam and task that plans are made for, in the coordinates of the planner."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from defmanip_gym.params import BeamParams, RobotParams, validated_sigma
from defmanip_gym.planning.drive import DriveLimit
from defmanip_gym.planning.limits import NO_MARGINS, Margins, PlanLimits
from defmanip_gym.planning.model import HEADING, REACH, STATE_SIZE, SWING, Array, TransportModel
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import require_finite_sequence, require_params, settle

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True, kw_only=True)
class PlanningSetting:
    """What is known of the world in which a plan is made; the defaults are DeformTransport-v0's.

    Attributes:
        robot: that moves.
        beam: that it carries, with the plant's damping; one segment.
        task: goal, limits and tolerances.
        sigma_rad: σ.
    """

    robot: RobotParams = field(default_factory=RobotParams)
    beam: BeamParams = field(default_factory=BeamParams)
    task: TaskParams = field(default_factory=TaskParams)
    sigma_rad: float = math.pi / 6

    def __post_init__(self) -> None:
        settle(self, "robot", require_params, RobotParams)
        settle(self, "beam", require_params, BeamParams)
        settle(self, "task", require_params, TaskParams)
        object.__setattr__(self, "sigma_rad", validated_sigma(self.sigma_rad))

    @cached_property
    def goal_reach_and_height_m(self) -> tuple[float, float]:
        """ρ and z of the grasp at the goal."""
        return self._reach_and_height(self.task.goal)

    @cached_property
    def model(self) -> TransportModel:
        """The reduced model.

        Raises:
            ParameterError: the beam has several segments.
        """
        return TransportModel.of(self.robot, self.beam, self.goal_reach_and_height_m[0])

    def limits(self, margins: Margins = NO_MARGINS) -> PlanLimits:
        """Return what motions keep to."""
        goal_pitch = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        return PlanLimits.of(
            self.task,
            self.robot,
            sigma_rad=self.sigma_rad,
            goal_height_m=self.goal_reach_and_height_m[1],
            drive=DriveLimit.of(self.robot, self.beam, goal_pitch),
            margins=margins,
        )

    @property
    def identity(self) -> dict[str, Any]:
        """What optimal times depend on, as JSON values."""
        return {"model": as_json(self.model), "limits": as_json(self.limits())}

    def state_at(self, start: Sequence[float]) -> Array:
        """Return the state (11,) at rest at a start (x, y, θ, q1, q2, φ), m and rad."""
        pose = require_finite_sequence("start", start, 6)
        goal = self.task.goal
        reach, height = self._reach_and_height(pose)
        goal_reach, goal_height = self.goal_reach_and_height_m
        heading = pose[2] - goal[2]
        cos, sin = math.cos(goal[2]), math.sin(goal[2])
        ahead, aside = pose[0] - goal[0], pose[1] - goal[1]
        state = np.zeros(STATE_SIZE)
        state[0] = cos * ahead + sin * aside + reach * math.cos(heading) - goal_reach
        state[1] = cos * aside - sin * ahead + reach * math.sin(heading)
        state[2] = height - goal_height
        state[HEADING] = math.remainder(heading, math.tau)
        state[REACH], state[SWING] = reach, pose[5]
        return state

    def _reach_and_height(self, pose: Sequence[float]) -> tuple[float, float]:
        pitch = JOINT_TO_PITCH @ np.array(pose[3:5])
        reach, height = ArmKinematics(self.robot).reach_and_height(pitch).tolist()
        return reach, height


def as_json(params: DataclassInstance) -> dict[str, Any]:
    """Return a dataclass as the values that JSON makes of it."""
    values: dict[str, Any] = json.loads(json.dumps(asdict(params)))
    return values
