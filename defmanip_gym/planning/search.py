"""The best of many local optima, refined on a finer grid."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.errors import ParameterError
from defmanip_gym.planning.guesses import guesses
from defmanip_gym.planning.limits import PlanLimits
from defmanip_gym.planning.model import Array, TransportModel
from defmanip_gym.planning.plan import Plan
from defmanip_gym.planning.problem import problem_for
from defmanip_gym.validation import require_whole, settle

_ALIKE_S = 1e-3  # optima closer than that are taken for one


@dataclass(frozen=True, kw_only=True)
class SearchParams:
    """How thoroughly plans are searched for.

    Attributes:
        coarse_intervals: K with which every guess is tried.
        fine_intervals: K of the plans that come out.
        kept: how many of the best coarse optima are refined.
        agreeing: the search ends when so many guesses have led to the best optimum.
    """

    coarse_intervals: int = 40
    fine_intervals: int = 120
    kept: int = 2
    agreeing: int = 4

    def __post_init__(self) -> None:
        settle(self, "coarse_intervals", require_whole, 10, 1000)
        settle(self, "fine_intervals", require_whole, 10, 1000)
        settle(self, "kept", require_whole, 1, 20)
        settle(self, "agreeing", require_whole, 1, 100)


def coarse_optima(
    model: TransportModel, limits: PlanLimits, state: Array, params: SearchParams
) -> list[Plan]:
    """Return the different local optima that the guesses lead to, quickest first."""
    problem = problem_for(model, limits, params.coarse_intervals)
    found: list[Plan] = []
    for guess in guesses(model, state, limits.speed_m_s, params.coarse_intervals):
        plan = problem.solve(state, guess)
        if plan is None:
            continue
        found = sorted([*found, plan], key=lambda plan: plan.duration_s)
        alike = found[0].duration_s + _ALIKE_S
        if sum(plan.duration_s < alike for plan in found) >= params.agreeing:
            break
    different: list[Plan] = []
    for plan in found:
        if not different or plan.duration_s > different[-1].duration_s + _ALIKE_S:
            different.append(plan)
    return different


def refined(
    model: TransportModel,
    limits: PlanLimits,
    state: Array,
    optima: list[Plan],
    params: SearchParams,
) -> Plan:
    """Return the quickest of the best optima on the fine grid.

    Raises:
        ParameterError: there is none, or none survives.
    """
    problem = problem_for(model, limits, params.fine_intervals)
    plans = [problem.solve(state, plan) for plan in optima[: params.kept]]
    found = [plan for plan in plans if plan is not None]
    if not found:
        raise ParameterError(
            "state",
            state.tolist(),
            "one from which the goal can be reached within all limits",
            "Look at the workspace's borders, or give the plan smaller margins.",
        )
    return min(found, key=lambda plan: plan.duration_s)


def best_plan(
    model: TransportModel,
    limits: PlanLimits,
    state: Array,
    params: SearchParams = SearchParams(),
) -> Plan:
    """Return the quickest plan found from a state, (11,).

    Raises:
        InstallationError: CasADi is not installed.
        ParameterError: nothing was found.
    """
    return refined(model, limits, state, coarse_optima(model, limits, state, params), params)
