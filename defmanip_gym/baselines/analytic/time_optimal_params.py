"""Design choices of ``time_optimal``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import get_args

from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.planning.limits import Margins
from defmanip_gym.planning.search import SearchParams
from defmanip_gym.planning.tracking import TrackingWeights
from defmanip_gym.validation import (
    require_choice,
    require_flag,
    require_non_negative,
    require_params,
    require_positive,
    settle,
)


@dataclass(frozen=True, kw_only=True)
class TimeOptimalParams:
    """Design choices.

    Attributes:
        margins: of plans that are made here; stored ones have been made with their own.
        weights: of the regulation about the plan.
        search: how thoroughly plans are searched for here.
        inner_loop: that the environment has; with ``"model"`` the first force reading tells the
            weight.
        observer_gain_per_s: L of the disturbance observer, 0 without one.
        replans: whether a plan is made anew where it was lost, which takes seconds, and CasADi.
        lost_m: off the plan by so much it is.
        patience_s: likewise, so long after its end.
    """

    margins: Margins = Margins()
    weights: TrackingWeights = TrackingWeights()
    search: SearchParams = field(default_factory=lambda: SearchParams(fine_intervals=80, kept=1))
    inner_loop: InnerLoopKind = "measured_force"
    observer_gain_per_s: float = 5.0
    replans: bool = False
    lost_m: float = 0.5
    patience_s: float = 1.0

    def __post_init__(self) -> None:
        settle(self, "margins", require_params, Margins)
        settle(self, "weights", require_params, TrackingWeights)
        settle(self, "search", require_params, SearchParams)
        require_choice("inner_loop", self.inner_loop, get_args(InnerLoopKind))
        settle(self, "observer_gain_per_s", require_non_negative, "1/s")
        settle(self, "replans", require_flag)
        settle(self, "lost_m", require_positive, "m")
        settle(self, "patience_s", require_positive, "s")
