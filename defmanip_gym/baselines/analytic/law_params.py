"""Design choices that all sampled laws have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import get_args

from defmanip_gym.baselines.analytic.way_params import WayParams
from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.validation import require_choice, require_non_negative, require_params, settle


@dataclass(frozen=True, kw_only=True)
class LawParams:
    """Design choices of every law.

    Attributes:
        inner_loop: that the environment is to have. The one that measures the grasp force needs no
            weight of the object.
        way: to the goal.
        observer_gain_per_s: L of the disturbance observer, 1/s; 0 leaves it at its first estimate.
    """

    inner_loop: InnerLoopKind = "measured_force"
    way: WayParams = field(default_factory=WayParams)
    observer_gain_per_s: float = 10.0

    def __post_init__(self) -> None:
        require_choice("inner_loop", self.inner_loop, get_args(InnerLoopKind))
        settle(self, "way", require_params, WayParams)
        settle(self, "observer_gain_per_s", require_non_negative, "1/s")
