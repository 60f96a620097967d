"""What a planned motion keeps to: the task's limits and tolerances, or less, to be driven."""

from __future__ import annotations

import math
from dataclasses import dataclass

from defmanip_gym.params import RobotParams, validated_sigma
from defmanip_gym.planning.drive import DriveLimit
from defmanip_gym.task_params import TaskParams
from defmanip_gym.validation import require_number, require_positive, settle

# of an arm folded onto itself
_ROUNDING_M = 1e-6


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Shares of the task's limits and tolerances that a plan uses, each in (0, 1].

    All ones give the optimum. The defaults leave room for tracking the plan inside a filter.

    Attributes:
        acceleration: of the largest |w| on each axis.
        speed: of the speed limit.
        swing: of σ.
        storage: of V_σ, which V may reach; None where the plan does not look at it.
        tolerance: of the tolerances that end an episode.
        effort_weight: on ∫|w|² dt beside the time, s³/m²: it decides what time leaves open.
    """

    acceleration: float = 0.9
    speed: float = 0.975
    swing: float = 0.9
    storage: float | None = 0.9
    tolerance: float = 0.5
    effort_weight: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("acceleration", "speed", "swing", "tolerance"):
            settle(self, name, require_number, 0.01, 1.0)
        if self.storage is not None:
            settle(self, "storage", require_number, 0.01, 1.0)
        settle(self, "effort_weight", require_number, 0.0, 1.0)


NO_MARGINS = Margins(
    acceleration=1.0, speed=1.0, swing=1.0, storage=None, tolerance=1.0, effort_weight=1e-5
)


@dataclass(frozen=True, kw_only=True)
class PlanLimits:
    """Bounds on a planned motion, m, s and rad; lengths are from the goal where not said otherwise.

    Attributes:
        acceleration_m_s2: |w| forward, left and up.
        speed_m_s: of the grasp.
        swing_rad: |φ|.
        storage_swing_rad: V may reach what it is at rest at this swing; None for any V.
        position_tolerance_m: at the end, as the following.
        speed_tolerance_m_s: of the grasp.
        swing_tolerance_rad: |φ|.
        heading_tolerance_rad: |θ − θ_goal|.
        arena_radius_m: of the base about the goal's base.
        lowest_m: of the grasp.
        shoulder_m: height of the shoulder over the goal's grasp.
        shortest_arm_m: shoulder to grasp, where the elbow is as bent as it may be.
        longest_arm_m: where it is as straight as it may be.
        drive: limit of the drive force; None where it is not looked at.
        effort_weight: on ∫|w|² dt, s³/m².
    """

    acceleration_m_s2: tuple[float, float, float]
    speed_m_s: float
    swing_rad: float
    storage_swing_rad: float | None
    position_tolerance_m: float
    speed_tolerance_m_s: float
    swing_tolerance_rad: float
    heading_tolerance_rad: float
    arena_radius_m: float
    lowest_m: float
    shoulder_m: float
    shortest_arm_m: float
    longest_arm_m: float
    drive: DriveLimit | None
    effort_weight: float

    @staticmethod
    def of(
        task: TaskParams,
        robot: RobotParams,
        *,
        sigma_rad: float,
        goal_height_m: float,
        drive: DriveLimit | None = None,
        margins: Margins = NO_MARGINS,
    ) -> PlanLimits:
        """Return the limits of a task, with margins.

        Args:
            task: limits, tolerances and workspace.
            robot: lengths of its arm.
            sigma_rad: σ.
            goal_height_m: of the grasp at the goal, from the floor.
            drive: limit of the drive force, of which no margin is taken.
            margins: shares of all that is used.
        """
        sigma_rad = validated_sigma(sigma_rad)
        goal_height_m = require_positive("goal_height_m", goal_height_m, "m")
        share, storage = margins.tolerance, margins.storage
        acceleration = margins.acceleration * task.max_acceleration_m_s2
        bend = task.smallest_elbow_bend_rad
        return PlanLimits(
            acceleration_m_s2=(acceleration, acceleration, acceleration),
            speed_m_s=margins.speed * task.max_speed_m_s,
            swing_rad=margins.swing * sigma_rad,
            storage_swing_rad=None
            if storage is None
            else math.acos(1 - storage * (1 - math.cos(sigma_rad))),
            position_tolerance_m=share * task.position_tolerance_m,
            speed_tolerance_m_s=share * task.speed_tolerance_m_s,
            swing_tolerance_rad=share * task.swing_tolerance_rad,
            heading_tolerance_rad=share * task.heading_tolerance_rad,
            arena_radius_m=task.arena_radius_m,
            lowest_m=task.smallest_grasp_height_m - goal_height_m,
            shoulder_m=robot.shoulder_height_m - goal_height_m,
            shortest_arm_m=_arm_length(robot, math.pi - bend),
            longest_arm_m=_arm_length(robot, bend),
            drive=drive,
            effort_weight=margins.effort_weight,
        )


def _arm_length(robot: RobotParams, bend_rad: float) -> float:
    """Return the distance from shoulder to grasp where the elbow is bent by an angle, m."""
    upper, fore = robot.upper_arm.length_m, robot.forearm.length_m
    squared = upper**2 + fore**2 + 2 * upper * fore * math.cos(bend_rad)
    return math.sqrt(max(squared, _ROUNDING_M**2))
