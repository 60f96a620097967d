"""Optimal times against linear programs, and what plans keep to."""

from __future__ import annotations

import math
import sys
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import linprog

from defmanip_gym.errors import InstallationError
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.planning.limits import NO_MARGINS, Margins
from defmanip_gym.planning.model import HEADING, REACH, SWING, SWING_RATE, advanced_rows
from defmanip_gym.planning.problem import TransportProblem
from defmanip_gym.planning.search import SearchParams, best_plan
from defmanip_gym.planning.setting import PlanningSetting

SETTING = PlanningSetting()
QUICK = SearchParams(coarse_intervals=30, fine_intervals=60, kept=1, agreeing=2)


def straight(distance_m):
    """Return the state behind the goal, with the arm as it is there."""
    state = np.zeros(11)
    state[0], state[REACH] = -distance_m, SETTING.model.goal_reach_m
    return state


def shortest_time_of_linear_programs(distance_m, limits, period_s=0.02):
    """Return the first sample at which the linear beam can be there: a program for each length."""
    model = SETTING.model
    c, d = model.coupling_per_m, model.damping_per_s
    A = np.array([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, -c * GRAVITY_M_S2, -d]])
    both = np.zeros((5, 5))
    both[:4, :4], both[:4, 4] = A, (0, 1, 0, -c)
    step = expm(both * period_s)
    A_d, b_d = step[:4, :4], step[:4, 4]

    def is_possible(count):
        responses = [b_d]
        for _ in range(count - 1):
            responses.append(A_d @ responses[-1])
        rows = np.array(responses)  # of one command, after 1, 2, ... periods
        shift = np.arange(count)[:, None] - np.arange(count)
        effect = np.where(shift[..., None] >= 0, rows[np.maximum(shift, 0)], 0.0)
        end, ones = effect[-1].T, np.ones(count)
        tolerances = np.array(
            (limits.position_tolerance_m, limits.speed_tolerance_m_s, limits.swing_tolerance_rad)
        )
        aim = np.array((distance_m, 0.0, 0.0))
        upper = np.vstack((effect[..., 1], effect[..., 2], -effect[..., 2], end[:3], -end[:3]))
        most = np.concatenate(
            (
                ones * limits.speed_m_s,
                ones * limits.swing_rad,
                ones * limits.swing_rad,
                tolerances + aim,
                tolerances - aim,
            )
        )
        bound = (-limits.acceleration_m_s2[0], limits.acceleration_m_s2[0])
        found = linprog(np.zeros(count), upper, most, bounds=[bound] * count, method="highs")
        return found.status == 0

    low, high = int(distance_m / limits.speed_m_s / period_s), int(20.0 / period_s)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_possible(middle) else (middle, high)
    return high * period_s


@pytest.fixture(scope="module")
def plan():
    pytest.importorskip("casadi")
    return best_plan(SETTING.model, SETTING.limits(), straight(10.1), QUICK)


def test_straight_motions_take_as_long_as_linear_programs_say(plan):
    reference = shortest_time_of_linear_programs(10.1, SETTING.limits())
    forward = replace(SETTING.limits(), acceleration_m_s2=(3.0, 0.0, 0.0))
    level = TransportProblem(SETTING.model, forward, 100).solve(plan.states[0], plan)
    assert level.duration_s == pytest.approx(reference, rel=0.01)
    assert plan.duration_s < level.duration_s  # lifting helps


def test_ending_at_rest_in_the_very_goal_takes_longer():
    exact = SETTING.limits(Margins(**(asdict(NO_MARGINS) | {"tolerance": 0.01})))
    assert shortest_time_of_linear_programs(10.1, exact) == pytest.approx(5.82)


def test_plans_keep_to_all_limits_and_end_within_tolerances(plan):
    limits, states = SETTING.limits(), plan.states
    assert (np.abs(plan.commands).max(axis=0) <= np.array(limits.acceleration_m_s2) + 1e-6).all()
    assert np.linalg.norm(states[:, 4:7], axis=1).max() <= limits.speed_m_s + 1e-6
    assert np.abs(states[:, SWING]).max() <= limits.swing_rad + 1e-6
    last = states[-1]
    assert np.linalg.norm(last[:3]) <= limits.position_tolerance_m + 1e-6
    assert np.linalg.norm(last[4:7]) <= limits.speed_tolerance_m_s + 1e-6
    assert abs(last[SWING]) <= limits.swing_tolerance_rad + 1e-6
    assert abs(last[HEADING]) <= limits.heading_tolerance_rad + 1e-6


def test_plans_are_motions_of_the_model(plan):
    moved = advanced_rows(
        SETTING.model, plan.states[:-1], plan.commands, np.full(len(plan.commands), plan.interval_s)
    )
    np.testing.assert_allclose(moved, plan.states[1:], atol=1e-6)


def test_finer_grids_change_the_time_by_less_than_half_a_percent(plan):
    problem = TransportProblem(SETTING.model, SETTING.limits(), 3 * len(plan.commands))
    finer = problem.solve(plan.states[0], plan)
    assert finer.duration_s == pytest.approx(plan.duration_s, rel=0.005)


def test_margins_cost_time_and_leave_room(plan):
    margins = Margins()
    limits = SETTING.limits(margins)
    problem = TransportProblem(SETTING.model, limits, 60)
    careful = problem.solve(plan.states[0], plan)
    assert careful.duration_s > plan.duration_s
    highest = SETTING.model.storage(SETTING.sigma_rad, 0.0)
    stored = SETTING.model.storage(careful.states[:, SWING], careful.states[:, SWING_RATE])
    assert stored.max() <= margins.storage * highest + 1e-5
    assert np.abs(careful.commands).max() <= limits.acceleration_m_s2[0] + 1e-6


def test_a_start_turned_away_is_planned_for_in_reverse_or_by_a_turn():
    pytest.importorskip("casadi")
    state = straight(6.0)
    state[HEADING] = math.pi
    plan = best_plan(SETTING.model, SETTING.limits(), state, QUICK)
    assert plan.duration_s < 6.0
    turned = math.remainder(plan.states[-1, HEADING], math.tau)
    assert abs(turned) <= SETTING.limits(NO_MARGINS).heading_tolerance_rad + 1e-6


def test_without_casadi_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(InstallationError, match=r"defmanip_gym\[plan\]"):
        TransportProblem(SETTING.model, SETTING.limits(), 10)
