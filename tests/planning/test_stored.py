"""Plans on disk: complete, true to what was written, and refused where foreign."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.suites import SUITES
from defmanip_gym.planning.model import HEADING, SWING, advanced_rows
from defmanip_gym.planning.plan_file import read_plans, shipped_plans, write_plans
from defmanip_gym.planning.search import best_plan
from defmanip_gym.planning.setting import PlanningSetting

SETTING = PlanningSetting()
LARGEST_FILE = 1_000_000


@pytest.mark.parametrize("suite", SUITES, ids=lambda suite: suite.name)
def test_every_scenario_has_an_optimum_and_a_plan(suite):
    for scenario in suite.scenarios:
        found = shipped_plans().find(scenario.start)
        assert found is not None and found.start == scenario.start
        assert 1.0 < found.drive.duration_s / found.optimum_s < 1.1


def test_the_stored_plans_are_motions_of_the_model_from_their_starts():
    for stored in shipped_plans().plans[::10]:
        drive = stored.drive
        begin = SETTING.state_at(stored.start)
        np.testing.assert_allclose(drive.states[0], begin, atol=6e-4)
        moved = advanced_rows(
            SETTING.model,
            drive.states[:-1],
            drive.commands,
            np.full(len(drive.commands), drive.interval_s),
        )
        np.testing.assert_allclose(moved, drive.states[1:], atol=5e-3)


@pytest.mark.parametrize(("suite", "index"), [("paper", 0), ("nominal", 5)])
def test_solving_again_gives_the_stored_optimum(suite, index):
    pytest.importorskip("casadi")
    start = {s.name: s for s in SUITES}[suite].scenarios[index].start
    plan = best_plan(SETTING.model, SETTING.limits(), SETTING.state_at(start))
    assert plan.duration_s == pytest.approx(shipped_plans().find(start).optimum_s, rel=0.003)


def test_no_stored_optimum_is_faster_than_straight_flight():
    task = SETTING.task
    for stored in shipped_plans().plans:
        away = np.linalg.norm(SETTING.state_at(stored.start)[:2]) - task.position_tolerance_m
        assert stored.optimum_s > away / task.max_speed_m_s + 0.5


def some(count=3):
    plans = shipped_plans()
    return replace(plans, plans=plans.plans[:count])


def test_a_file_gives_back_what_was_written(tmp_path):
    path, plans = tmp_path / "plans.npz", some()
    write_plans(path, plans)
    again = read_plans(path)
    assert again.digest == plans.digest
    assert again.made_with == plans.made_with
    assert [plan.drive.guess for plan in again.plans] == [plan.drive.guess for plan in plans.plans]


def test_starts_are_found_exactly_and_states_whatever_turn_their_heading_is_on():
    plans = some()
    sought = plans.plans[1]
    x, *rest = sought.start
    assert plans.find(sought.start) is sought
    assert plans.find((x + 1e-3, *rest)) is None
    state = SETTING.state_at(sought.start)
    state[HEADING] += math.tau
    state[SWING] += 0.1
    assert plans.find_state(state, swing_tolerance_rad=0.01) is None
    assert plans.find_state(state, swing_tolerance_rad=0.2) is sought
    state[0] += 0.01
    assert plans.find_state(state, swing_tolerance_rad=0.2) is None


def test_a_new_plan_takes_the_place_of_the_old_one():
    plans = some()
    newer = replace(plans.plans[0], optimum_s=1.0)
    again = plans.including(newer)
    assert len(again.plans) == 3 and again.find(newer.start).optimum_s == 1.0


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 nothing"])
def test_files_of_others_are_refused(tmp_path, content):
    path = tmp_path / "plans.npz"
    path.write_bytes(content)
    with pytest.raises(RecordError, match="defmanip plan"):
        read_plans(path)


def test_the_file_is_small(tmp_path):
    write_plans(tmp_path / "plans.npz", shipped_plans())
    assert (tmp_path / "plans.npz").stat().st_size < LARGEST_FILE
