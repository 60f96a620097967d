"""``defmanip plan``: what it writes, and that it goes on where it ended."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.oracle import command
from defmanip_gym.oracle.command import run_plan
from defmanip_gym.oracle.config import PlanConfig
from defmanip_gym.planning.plan_file import read_plans, shipped_plans
from defmanip_gym.planning.search import SearchParams

QUICK = SearchParams(coarse_intervals=30, fine_intervals=40, kept=1, agreeing=1)


@pytest.fixture
def config(tmp_path):
    pytest.importorskip("casadi")
    return PlanConfig(output=tmp_path / "plans.npz", suites=("paper",), search=QUICK)


def test_the_file_holds_a_plan_for_every_start_and_is_gone_on_with(config, monkeypatch):
    run_plan(config)
    (plan,) = read_plans(config.output).plans
    assert plan.start == suite_named("paper").scenarios[0].start
    assert plan.drive.commands.shape == (QUICK.fine_intervals, 3)
    monkeypatch.setattr(command, "planned", None)  # nothing is left to plan
    assert run_plan(config).find(plan.start).optimum_s == plan.optimum_s


def test_other_settings_begin_anew(config):
    plans = run_plan(config)
    other = replace(config, search=replace(QUICK, fine_intervals=30))
    assert run_plan(other).plans[0].drive.commands.shape == (30, 3)
    assert plans.made_with != run_plan(other).made_with


@pytest.mark.parametrize("option", ["output", "page"])
@pytest.mark.parametrize("place", ["", "file/below", "x" * 300], ids=["folder", "file", "long"])
def test_a_place_that_cannot_be_written_is_refused_before_anything_is_planned(
    tmp_path, monkeypatch, option, place
):
    (tmp_path / "file").touch()
    monkeypatch.setattr(command, "planned", lambda *_: pytest.fail("planned"))
    config = PlanConfig(output=tmp_path / "plans.npz", suites=("paper",), fresh=True)
    with pytest.raises(RecordError, match=f"{option} is .*can be written"):
        run_plan(replace(config, **{option: tmp_path / place}))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_starts_are_planned_for_once():
    config = PlanConfig(output=None)
    scenarios = [s for suite in config.chosen for s in suite.scenarios]
    assert len(config.starts) == len({s.start for s in scenarios}) == len(shipped_plans().plans)


def test_the_page_tells_of_every_scenario_and_condition(config):
    page = command.optimum_page(run_plan(config), config.chosen)
    for scenario in suite_named("paper").scenarios:
        assert f"`{scenario.condition.name}` | 1 |" in page
        line = rf"\| paper \| `{scenario.name}` \| (\S+) \| (\S+) \| (\w+) \|\n"
        ((optimum, share, outcome),) = re.findall(line, page)
        assert 5.5 < float(optimum) < 5.7 and 1.0 < float(share) < 1.3
        assert outcome == "success"
