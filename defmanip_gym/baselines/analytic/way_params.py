"""The way to the goal that the ladder's controllers share: a velocity field by its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.oriented_field import OrientedField
from defmanip_gym.theory.control.settling_field import SettlingField
from defmanip_gym.theory.control.velocity_field import NormalizedField, VelocityField
from defmanip_gym.validation import require_between, require_choice, require_positive, settle

WayKind = Literal["normalized", "oriented"]

_LATERAL_SHARE = 0.85  # of the task's acceleration in arcs


@dataclass(frozen=True, kw_only=True)
class WayParams:
    """The field that leads to the goal, and how fast it is travelled.

    Attributes:
        velocity_field: ``"oriented"`` leads straight to an arc that arrives along +x, from
            anywhere; ``"normalized"`` are the dipole's streamlines.
        turn_radius_m: R of the oriented field's arcs.
        yaw_rate_rad_s: largest in its arcs.
        settling_radius_m: within which the way goes straight to the goal.
        speed_share: of the task's speed limit, in (0, 1).
        deceleration_m_s2: to brake with on the way.
        vertical_deceleration_m_s2: to brake with in height.
        approach_rate_per_s: speed per distance near the goal, 1/s.
    """

    velocity_field: WayKind = "oriented"
    turn_radius_m: float = 4.0
    yaw_rate_rad_s: float = 2.5
    settling_radius_m: float = 0.2
    speed_share: float = 0.975
    deceleration_m_s2: float = 1.5
    vertical_deceleration_m_s2: float = 1.0
    approach_rate_per_s: float = 3.0

    def __post_init__(self) -> None:
        require_choice("velocity_field", self.velocity_field, get_args(WayKind))
        settle(self, "speed_share", require_between, 0.0, 1.0)
        for name in (
            "turn_radius_m",
            "yaw_rate_rad_s",
            "settling_radius_m",
            "deceleration_m_s2",
            "vertical_deceleration_m_s2",
            "approach_rate_per_s",
        ):
            settle(self, name, require_positive)

    def speed_m_s(self, task: TaskParams) -> float:
        """Return the highest speed on the way."""
        return self.speed_share * task.max_speed_m_s

    def field(self, task: TaskParams, goal_reach_m: float) -> VelocityField:
        """Return the field for a task whose arm reaches that far at the goal.

        Laws ask it about positions alone: the grasp is led, and the base follows as a trailer does.
        """
        if self.velocity_field == "normalized":
            return NormalizedField(
                max_speed_m_s=self.speed_m_s(task),
                deceleration_m_s2=self.deceleration_m_s2,
                vertical_deceleration_m_s2=self.vertical_deceleration_m_s2,
                approach_rate_per_s=self.approach_rate_per_s,
            )
        oriented = OrientedField(
            reach_m=goal_reach_m,
            max_speed_m_s=self.speed_m_s(task),
            deceleration_m_s2=self.deceleration_m_s2,
            vertical_deceleration_m_s2=self.vertical_deceleration_m_s2,
            approach_rate_per_s=self.approach_rate_per_s,
            lateral_acceleration_m_s2=_LATERAL_SHARE * task.max_acceleration_m_s2,
            yaw_rate_rad_s=self.yaw_rate_rad_s,
            turn_radius_m=self.turn_radius_m,
        )
        return SettlingField(field=oriented, radius_m=self.settling_radius_m)
