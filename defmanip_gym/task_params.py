"""Parameters of the transport task: starts, goal, tolerances, limits, timing, reward.

As in :mod:`defmanip_gym.params`, units stand in the names and every constructor raises
:class:`~defmanip_gym.errors.ParameterError`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import (
    require_between,
    require_finite_sequence,
    require_non_negative,
    require_number,
    require_params,
    require_range,
    settle,
)

# Physics steps of one control period; with more, a step would take longer than anybody waits.
_MOST_SUBSTEPS = 1000


@dataclass(frozen=True, kw_only=True)
class RewardParams:
    """Weights of the reward terms; see the environment's documentation for their formulas."""

    distance_weight_per_m: float = 1.0
    course_weight_per_rad: float = 10.0
    closeness_weight: float = 5.0
    approach_speed_per_m: float = 1.0
    approach_swing_rad_per_m: float = 0.5
    time_to_go_weight_per_s: float = 0.0
    swing_cost_s_per_rad: float = 0.3
    time_cost_per_step: float = 0.02
    effort_weight: float = 0.001
    success_bonus: float = 10.0
    failure_penalty: float = 10.0
    deformation_penalty: float = 1.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            settle(self, name, require_non_negative)


@dataclass(frozen=True, kw_only=True)
class StartParams:
    """Where episodes start: uniformly within ``spread`` of ``center``, at rest.

    Both are (x, y, θ, q1, q2, φ); the center is the start of the paper's simulation. With
    ``distance_m`` the base starts that far from the goal's, between the two numbers, at any bearing
    and with any heading instead; its area is not covered evenly, its distances are.
    """

    center: tuple[float, ...] = (-8.5, 5.5, 0.0, math.pi / 3, -math.pi / 2, 0.0)
    spread: tuple[float, ...] = (1.5, 1.5, 0.5, 0.1, 0.1, 0.05)
    distance_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        settle(self, "center", require_finite_sequence, 6)
        settle(self, "spread", require_finite_sequence, 6)
        if min(self.spread) < 0:
            raise ParameterError("spread", self.spread, "6 numbers >= 0", "Give half-widths.")
        if self.distance_m is not None:
            settle(self, "distance_m", require_range, 0.0, 1e4, "m")

    @property
    def largest_swing_rad(self) -> float:
        """The largest initial |φ| that sampling can give."""
        return abs(self.center[5]) + self.spread[5]


@dataclass(frozen=True, kw_only=True)
class TaskParams:
    """Goal, tolerances, limits and timing of the transport task.

    ``goal`` is (x, y, θ, q1, q2, φ) as in the paper's Section VI.
    """

    goal: tuple[float, ...] = (0.0, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)
    start: StartParams = field(default_factory=StartParams)
    max_acceleration_m_s2: float = 3.0
    max_speed_m_s: float = 2.0
    position_tolerance_m: float = 0.05
    speed_tolerance_m_s: float = 0.05
    swing_tolerance_rad: float = 0.05
    heading_tolerance_rad: float = 0.2
    course_blend_radius_m: float = 0.3
    arena_radius_m: float = 20.0
    smallest_elbow_bend_rad: float = 0.15
    smallest_reach_m: float = 0.25
    smallest_grasp_height_m: float = 0.1
    control_period_s: float = 0.02
    physics_period_s: float = 0.005
    reward: RewardParams = field(default_factory=RewardParams)

    def __post_init__(self) -> None:
        settle(self, "goal", require_finite_sequence, 6)
        settle(self, "start", require_params, StartParams)
        settle(self, "reward", require_params, RewardParams)
        for name, low, high, unit in (
            ("max_acceleration_m_s2", 1e-3, 1e3, "m/s²"),
            ("max_speed_m_s", 1e-3, 1e3, "m/s"),
            ("position_tolerance_m", 1e-6, 1e3, "m"),
            ("speed_tolerance_m_s", 1e-6, 1e3, "m/s"),
            ("swing_tolerance_rad", 1e-6, 1e3, "rad"),
            ("heading_tolerance_rad", 1e-6, 1e3, "rad"),
            ("course_blend_radius_m", 1e-6, 1e3, "m"),
            ("arena_radius_m", 1e-3, 1e4, "m"),
            ("smallest_reach_m", 1e-3, 1e3, "m"),
            ("smallest_grasp_height_m", 1e-6, 1e3, "m"),
            ("control_period_s", 1e-5, 10.0, "s"),
            ("physics_period_s", 1e-5, 1.0, "s"),
        ):
            settle(self, name, require_number, low, high, unit)
        settle(self, "smallest_elbow_bend_rad", require_between, 0.0, math.pi / 2)
        ratio = self.control_period_s / self.physics_period_s
        if not 1 <= round(ratio) <= _MOST_SUBSTEPS or abs(ratio - round(ratio)) > 1e-9:
            raise ParameterError(
                "control_period_s",
                self.control_period_s,
                f"a whole multiple of physics_period_s={self.physics_period_s}, at most "
                f"{_MOST_SUBSTEPS} times as long",
                "Change one of the two periods.",
            )

    @property
    def substeps(self) -> int:
        """Physics steps in one control period."""
        return round(self.control_period_s / self.physics_period_s)
