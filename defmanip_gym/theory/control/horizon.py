"""What the program of ``receding_horizon`` pays for, and what it is about."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.theory.control.prediction import HeadingForecast
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_non_negative, require_positive, settle


@dataclass(frozen=True, kw_only=True)
class HorizonWeights:
    """Costs of a second of each.

    Attributes:
        position: per m² from the reference.
        velocity: per (m/s)² from the reference's.
        swing: per rad² of each internal coordinate.
        swing_rate: per (rad/s)².
        acceleration: per (m/s²)².
        heading: per rad² from what the goal allows, where the reference is there.
        heading_radius_m: how near that is.
        terminal_s: how much longer than its block the last point counts.
    """

    position: float = 22.3
    velocity: float = 1.17
    swing: float = 0.006
    swing_rate: float = 0.078
    acceleration: float = 0.02
    heading: float = 1.57
    heading_radius_m: float = 0.5
    terminal_s: float = 1.96

    def __post_init__(self) -> None:
        for name in ("position", "acceleration", "heading_radius_m"):
            settle(self, name, require_positive)
        for name in ("velocity", "swing", "swing_rate", "heading", "terminal_s"):
            settle(self, name, require_non_negative)


@dataclass(frozen=True, kw_only=True)
class HorizonStart:
    """Where n episodes are and where they are going, in axes that do not turn, the goal's.

    Attributes:
        position: of the grasp, (n, 2) m.
        velocity: (n, 2) m/s.
        swing: η, (n, 2N).
        reference: r at the end of each block, (n, M, 2) m.
        reference_velocity: ṙ, (n, M, 2) m/s.
        headings: as the last plan leads to them.
        courses: where the grasp moves at the end of each block, (n, M) rad.
        speed_limit: (n,) m/s.
        plan: the last one, (n, M, 2) m/s²; the search begins there.
    """

    position: Array
    velocity: Array
    swing: Array
    reference: Array
    reference_velocity: Array
    headings: HeadingForecast
    courses: Array
    speed_limit: Array
    plan: Array
