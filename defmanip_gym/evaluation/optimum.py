"""T*, the time-optimal time from a start of a suite, and what share of it an episode reached."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.suites import Start
from defmanip_gym.planning.plan_file import shipped_plans


def optimum_s(start: Start) -> float | None:
    """Return T* from a start, s; None from one that no suite has.

    It is the nominal model's, whatever the condition: what could be reached if robot and beam were
    as everybody believes, without disturbance.
    """
    return _optima().get(tuple(start))


def optimum_share(record: EpisodeRecord) -> float | None:
    """Return T*/T of an episode, 0 without success; None where T* is not known."""
    optimum = optimum_s(record.start)
    if optimum is None:
        return None
    if not record.success or record.time_to_goal_s is None:
        return 0.0
    return optimum / record.time_to_goal_s


@lru_cache(maxsize=1)
def _optima() -> Mapping[Start, float]:
    return {plan.start: plan.optimum_s for plan in shipped_plans().plans}
