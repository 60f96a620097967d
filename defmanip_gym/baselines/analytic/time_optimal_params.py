"""Design choices of ``time_optimal``."""

from __future__ import annotations

from dataclasses import dataclass, field

from defmanip_gym.baselines.analytic.law_params import LawParams
from defmanip_gym.planning.limits import Margins
from defmanip_gym.planning.search import SearchParams
from defmanip_gym.planning.tracking import TrackingWeights
from defmanip_gym.validation import (
    require_flag,
    require_params,
    require_positive,
    settle,
)


@dataclass(frozen=True, kw_only=True)
class TimeOptimalParams(LawParams):
    """Design choices.

    Attributes:
        margins: of plans that are made here; stored ones have been made with their own.
        weights: of the regulation about the plan.
        search: how thoroughly plans are searched for here.
        observer_gain_per_s: L of the disturbance observer, 1/s.
        replans: whether a plan is made anew where it was lost, which takes seconds, and CasADi.
        lost_m: off the plan by so much it is.
        patience_s: likewise, so long after its end.
    """

    margins: Margins = Margins()
    weights: TrackingWeights = TrackingWeights()
    search: SearchParams = field(default_factory=lambda: SearchParams(fine_intervals=80, kept=1))
    observer_gain_per_s: float = 5.0
    replans: bool = False
    lost_m: float = 0.5
    patience_s: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        settle(self, "margins", require_params, Margins)
        settle(self, "weights", require_params, TrackingWeights)
        settle(self, "search", require_params, SearchParams)
        settle(self, "replans", require_flag)
        settle(self, "lost_m", require_positive, "m")
        settle(self, "patience_s", require_positive, "s")
