"""Everything that defines a DeformTransport environment, validated in one place."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, is_dataclass
from typing import Any, Literal, get_args

import numpy as np

from defmanip_gym.disturbance_ranges import DisturbanceRanges
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import (
    BeamParams,
    BeamRanges,
    DisturbanceParams,
    RobotParams,
    validated_sigma,
)
from defmanip_gym.payloads.choice import require_payload
from defmanip_gym.payloads.payload import Payload
from defmanip_gym.payloads.rod import RodPayload, rod_of
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import require_choice, require_params, settle

ControlMode = Literal["task", "force"]
ConstraintMode = Literal["terminate", "penalty", "cost"]
InnerLoopKind = Literal["model", "measured_force"]


@dataclass(frozen=True, kw_only=True)
class TransportConfig:
    """Arguments of the environment; see its documentation.

    Parameters may also be mappings of their fields, as the JSON of a Gymnasium specification holds
    them; those that a mapping leaves out are as by default. ``robot`` and ``payload`` are true;
    ``nominal_robot`` and the payload's ``believed`` are what the built-in feedback linearization
    believes. By default it believes the truth, except that it counts on no damping at the root.
    ``inner_loop="measured_force"`` takes the grasp force as the sensor reads it, noise included, in
    the place of any belief about the payload.
    """

    control_mode: ControlMode = "task"
    inner_loop: InnerLoopKind = "model"
    constraint_mode: ConstraintMode = "terminate"
    sigma_rad: float = math.pi / 6
    robot: RobotParams = field(default_factory=RobotParams)
    payload: Payload = field(default_factory=RodPayload)
    nominal_robot: RobotParams | None = None
    task: TaskParams = field(default_factory=TaskParams)
    disturbance: DisturbanceParams = field(default_factory=DisturbanceParams)
    disturbance_ranges: DisturbanceRanges = field(default_factory=DisturbanceRanges)

    def __post_init__(self) -> None:
        for name, kind, optional in (
            ("robot", RobotParams, False),
            ("nominal_robot", RobotParams, True),
            ("task", TaskParams, False),
            ("disturbance", DisturbanceParams, False),
            ("disturbance_ranges", DisturbanceRanges, False),
        ):
            if not (optional and getattr(self, name) is None):
                settle(self, name, require_params, kind)
        require_choice("control_mode", self.control_mode, get_args(ControlMode))
        require_choice("inner_loop", self.inner_loop, get_args(InnerLoopKind))
        require_choice("constraint_mode", self.constraint_mode, get_args(ConstraintMode))
        object.__setattr__(self, "sigma_rad", validated_sigma(self.sigma_rad))
        if self.task.start.largest_swing_rad > self.sigma_rad:
            raise ParameterError(
                "task.start",
                self.task.start,
                f"|φ| <= σ = {self.sigma_rad:.4g} rad at every sampled start",
                "Narrow its spread or raise sigma_rad.",
            )
        object.__setattr__(self, "payload", require_payload("payload", self.payload))
        needs_rod = self.control_mode == "task" and self.inner_loop == "model"
        if needs_rod and self.payload.believed is None:
            raise ParameterError(
                "inner_loop",
                self.inner_loop,
                "'measured_force' for a payload of which there is no rod to believe in",
                "Pass inner_loop='measured_force'.",
            )

    @property
    def largest_disturbance(self) -> DisturbanceParams:
        """The disturbance, with the largest values that an episode may draw."""
        return self.disturbance_ranges.largest(self.disturbance)

    @property
    def believed_robot(self) -> RobotParams:
        """Robot parameters of the feedback linearization."""
        return self.nominal_robot or self.robot

    @property
    def identity(self) -> dict[str, Any]:
        """All of it, as records of episodes identify their environment."""
        fields_ = {name: getattr(self, name) for name in self.__dataclass_fields__}
        del fields_["payload"]
        told = {
            name: asdict(value) if is_dataclass(value) and not isinstance(value, type) else value
            for name, value in fields_.items()
        }
        return told | self.payload.identity

    @property
    def rod(self) -> RodPayload:
        """The payload, for what knows rods only.

        Raises:
            PayloadError: it is another one.
        """
        return rod_of(self.payload)

    @property
    def beam(self) -> BeamParams:
        """The true beam, but for what ``beam_ranges`` vary."""
        return self.rod.beam

    @property
    def beam_ranges(self) -> BeamRanges:
        """What each episode draws of it."""
        return self.rod.beam_ranges

    @property
    def nominal_beam(self) -> BeamParams | None:
        """The beam of the feedback linearization, if it is not the true one."""
        return self.rod.nominal_beam

    @property
    def believed_beam(self) -> BeamParams:
        """Beam parameters of the feedback linearization."""
        return self.rod.believed

    @property
    def goal_reach_and_height_m(self) -> tuple[float, float]:
        """(ρ, z) of the grasp at the goal."""
        pitch = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        reach, height = ArmKinematics(self.robot).reach_and_height(pitch).tolist()
        return reach, height

    @property
    def goal_position_m(self) -> tuple[float, float, float]:
        """Grasp position at the goal, world frame."""
        x, y, heading = self.task.goal[:3]
        reach, height = self.goal_reach_and_height_m
        return x + reach * math.cos(heading), y + reach * math.sin(heading), height
