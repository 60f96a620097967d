"""The table of filters: pairs of episodes, alone and inside, and what a decision takes."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from episodes import record
from rich.console import Console
from suite_records import contestant

from defmanip_gym.evaluation import filter_timings
from defmanip_gym.evaluation.filter_timings import (
    FilterTimes,
    filter_times,
    measured_filter_times,
    read_filter_times,
)
from defmanip_gym.evaluation.measures import _reversal_rate
from defmanip_gym.evaluation.protection import Certificates, protection_named
from defmanip_gym.evaluation.report.exports import latex_filter_table, markdown_filter_table
from defmanip_gym.evaluation.report.filter_columns import FILTER_COLUMNS, FilterRow
from defmanip_gym.evaluation.report.terminal import filter_terminal_table
from defmanip_gym.evaluation.statistics.filter_effects import FilterPairs, filter_effects
from defmanip_gym.evaluation.viable_shares import viable_share

COMMAND = "python evaluate.py --output some_where"
STORAGE = FilterPairs(name="storage", contestants={"ppo/storage": "ppo", "sac/storage": "sac"})


def alone(name, scenario, **changes):
    return record(contestant=name, scenario=scenario, member="0", **changes)


def inside(name, scenario, **changes):
    filtered = {
        "interventions": 0.1,
        "mean_intervention_m_s2": 0.05,
        "largest_correction_m_s2": 2.0,
        "correction_reversals_per_s": 1.0,
    }
    return alone(f"{name}/storage", scenario, **{**filtered, **changes})


def violation():
    return {"outcome": "violation", "success": False, "violated": True}


@pytest.fixture
def rows():
    records = [
        alone("ppo", "a", **violation()),
        alone("ppo", "b"),
        inside("ppo", "a", duration_s=30.0),
        inside("ppo", "b", interventions=0.5, mean_intervention_m_s2=0.45),
    ]
    (effect,) = filter_effects(records, [STORAGE])
    return [
        FilterRow(
            effect=effect,
            times=FilterTimes(median_s=2.5e-5, p99_s=1e-4),
            viable_share=0.5,
        )
    ]


def test_rates_are_of_pairs_alone_and_inside(rows):
    effect = rows[0].effect
    assert effect.controllers == ("ppo",)
    assert (effect.violation_alone.count, effect.violation_inside.count) == (1, 0)
    assert (effect.success_alone.share, effect.success_inside.share) == (0.5, 1.0)


def test_corrections_are_means_over_steps_and_over_those_that_were_changed(rows):
    effect = rows[0].effect
    assert effect.changed == pytest.approx((30 * 0.1 + 10 * 0.5) / 40)
    assert effect.mean_correction_m_s2 == pytest.approx((30 * 0.05 + 10 * 0.45) / (3 + 5))
    assert (effect.largest_correction_m_s2, effect.reversals_per_s) == (2.0, 1.0)


def test_episodes_without_their_pair_do_not_count():
    records = [alone("ppo", "a"), inside("ppo", "a"), inside("sac", "a"), inside("ppo", "b")]
    (effect,) = filter_effects(records, [STORAGE])
    assert effect.violation_inside.trials == effect.violation_alone.trials == 1
    assert filter_effects(records[2:], [STORAGE]) == ()


def test_intervals_count_scenarios_not_controllers():
    names = ("ppo", "sac")
    records = [each(name, s) for name in names for s in "abcd" for each in (alone, inside)]
    (both,) = filter_effects(records, [STORAGE])
    (one,) = filter_effects([r for r in records if "ppo" in r.contestant], [STORAGE])
    assert both.success_inside.trials == 2 * one.success_inside.trials
    assert both.success_inside.interval == one.success_inside.interval


def test_a_filter_that_changed_nothing_has_no_mean_correction():
    idle = dict(interventions=0.0, mean_intervention_m_s2=0.0, largest_correction_m_s2=0.0)
    (effect,) = filter_effects([alone("ppo", "a"), inside("ppo", "a", **idle)], [STORAGE])
    assert effect.mean_correction_m_s2 is None and effect.largest_correction_m_s2 == 0.0


@pytest.mark.parametrize(
    ("corrections", "reversals"),
    [([1, -1, 1], 2), ([1, 0, 0, -1], 1), ([1, 0, 2], 0), ([0, 0], 0), ([1, 1e-12, -1e-12], 0)],
)
def test_reversals_are_changes_of_sign_among_corrections(corrections, reversals):
    assert _reversal_rate(np.array(corrections, dtype=float), 0.5) == 2 * reversals


def test_tables_have_a_cell_for_every_column(rows):
    markdown = markdown_filter_table(rows, COMMAND)
    cells = {len(re.findall(r"\|", line)) for line in markdown.splitlines() if "|" in line}
    assert cells == {len(FILTER_COLUMNS) + 2} and f"`{COMMAND}`" in markdown
    latex = latex_filter_table("nominal", rows, COMMAND)
    lines = [line for line in latex.splitlines() if line.endswith(r"\\") and "&" in line]
    assert {line.count("&") for line in lines} == {len(FILTER_COLUMNS)} and len(lines) == 2
    assert latex.isascii()
    for column in FILTER_COLUMNS:
        assert column.legend and column.cell(rows[0]).value


def test_the_terminal_table_leads_from_alone_to_inside(rows):
    buffer = io.StringIO()
    Console(file=buffer, width=120).print(filter_terminal_table("nominal", rows))
    assert "50 → 0" in buffer.getvalue() and "50 → 100" in buffer.getvalue()
    assert "…" not in buffer.getvalue() and " 25" in buffer.getvalue()


def test_what_is_kept_of_the_viable_set_is_told_where_it_is_known():
    certificates = Certificates()
    shares = {
        name: viable_share(protection_named(name, certificates))
        for name in ("storage", "backup", "l1", "tanner")
    }
    assert 0.4 < shares["storage"] < 0.7 and 0 < shares["l1"] < 0.7
    assert shares["backup"] is None  # not known
    assert shares["tanner"] is None  # of another beam


def test_names_alone_are_without_the_filter():
    protection = protection_named("storage", Certificates())
    inside = contestant("a/b/storage", "learned", protection=protection)
    assert inside.name_alone == "a/b"
    assert replace(inside, protection=None).name_alone == "a/b/storage"


def test_times_are_measured_once_for_each_filter(tmp_path):
    asked, path = [], tmp_path / "times.json"
    certificates = Certificates()
    protections = [protection_named(name, certificates) for name in ("storage", "l1", "storage")]

    def measure(protection):
        asked.append(protection.method)
        return FilterTimes(median_s=1.0, p99_s=2.0)

    for _ in range(2):
        times = measured_filter_times(path, protections, measure)
    assert asked == ["storage", "l1"] and set(times) == {"storage", "l1"}
    assert read_filter_times(path) == times
    for damaged in ("[]", "{", '{"storage": 1.0}'):
        path.write_text(damaged)
        assert read_filter_times(path) == {}


@pytest.mark.parametrize("name", ["storage", "l1"])
def test_a_filter_is_timed_while_it_has_to_change_commands(name, monkeypatch):
    monkeypatch.setattr(filter_timings, "_SAMPLES", 60)
    protection = protection_named(name, Certificates())
    changed = []

    class Watched:
        method = name

        def filter_for(self, condition):
            made = protection.filter_for(condition)
            certify = type(made).certify_action

            def certify_action(self, wished, observation, memory):
                decision = certify(self, wished, observation, memory)
                changed.append(bool((decision.allowed_m_s2 != wished).any()))
                return decision

            monkeypatch.setattr(type(made), "certify_action", certify_action)
            return made

    times = filter_times(Watched())
    assert 0 < times.median_s <= times.p99_s
    assert np.mean(changed) > 0.3
