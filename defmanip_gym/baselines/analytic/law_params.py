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
        observer_gain_per_s: L of the disturbance observer, 1/s; 0 leaves it at its first estimate.
    """

    inner_loop: InnerLoopKind = "measured_force"
    observer_gain_per_s: float = 10.0

    def __post_init__(self) -> None:
        require_choice("inner_loop", self.inner_loop, get_args(InnerLoopKind))
        settle(self, "observer_gain_per_s", require_non_negative, "1/s")


@dataclass(frozen=True, kw_only=True)
class WayLawParams(LawParams):
    """Design choices of every law that is led by a velocity field.

    Attributes:
        way: to the goal.
    """

    way: WayParams = field(default_factory=WayParams)

    def __post_init__(self) -> None:
        super().__post_init__()
        settle(self, "way", require_params, WayParams)
