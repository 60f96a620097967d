"""A contestant's row of the table."""

from __future__ import annotations

import numpy as np
import pytest
from episodes import record
from suite_records import table

from defmanip_gym.evaluation.statistics.episode_table import tabulate
from defmanip_gym.evaluation.statistics.intervals import wilson_interval
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap
from defmanip_gym.evaluation.statistics.scores import score
from defmanip_gym.evaluation.statistics.summary import summarize


def summary_of(made):
    bootstrap = CrossedBootstrap(made.conditions, resamples=300)
    return summarize(bootstrap, score(bootstrap, made))


def summary_of_records(*changes):
    records = [record(scenario=f"s{index}", **change) for index, change in enumerate(changes)]
    (made,) = tabulate(records, "nominal")
    return summary_of(made)


def test_each_outcome_is_counted_and_only_successes_are_timed():
    summary = summary_of_records(
        {"time_to_goal_s": 8.0, "path_length_m": 9.0},
        {"time_to_goal_s": 12.0, "path_length_m": 11.0},
        {
            "outcome": "violation",
            "success": False,
            "violated": True,
            "largest_swing_share": 1.4,
            "time_to_goal_s": 3.0,
        },
        {"outcome": "timeout", "success": False, "time_to_goal_s": None},
    )
    assert (summary.success.count, summary.success.trials) == (2, 4)
    assert summary.violation.share == 0.25
    assert summary.outcomes["timeout"] == 1
    assert summary.largest_swing_share == 1.4
    assert summary.time_to_goal_s.value == 10.0
    assert summary.path_length_m.value == 10.0
    assert summary.interventions is None


def test_without_success_there_is_no_time_to_goal():
    summary = summary_of_records({"outcome": "timeout", "success": False, "time_to_goal_s": None})
    assert summary.time_to_goal_s is None
    assert summary.score["iqm"].value == 0.0


def test_a_single_episode_has_no_interval():
    summary = summary_of_records({})
    assert summary.score["iqm"].value == pytest.approx(0.5)
    assert summary.score["iqm"].interval is None
    assert summary.score_iqm_retrained is None


def test_interventions_are_averaged_over_steps_not_episodes():
    summary = summary_of_records(
        {"duration_s": 1.0, "interventions": 1.0, "mean_intervention_m_s2": 2.0},
        {"duration_s": 9.0, "interventions": 0.0, "mean_intervention_m_s2": 0.0},
    )
    assert summary.interventions == pytest.approx(0.1)
    assert summary.mean_intervention_m_s2 == pytest.approx(0.2)


def test_the_tail_is_the_worst_tenth():
    shares = np.linspace(0.05, 1.0, 20)
    summary = summary_of_records(*({"largest_swing_share": share} for share in shares))
    assert summary.swing_share_cvar.value == pytest.approx((shares[-1] + shares[-2]) / 2)


def test_certificates_that_do_not_cover_the_plant_show():
    summary = summary_of_records({"certificate_applies": True}, {"certificate_applies": False})
    assert summary.certificate_applies == 0.5


def test_rates_of_members_that_differ_are_wider_than_wilsons():
    scores = np.full((5, 20), 0.4)
    scores[:2] = 0.0  # two members never arrive
    low, high = summary_of(table("ppo", scores)).success.interval
    wilson = wilson_interval(12, 20)
    assert low < wilson[0] - 0.1 and high > wilson[1] + 0.1


def test_rates_of_members_that_agree_are_as_uncertain_as_one_members():
    summary = summary_of(table("ppo", np.full((5, 20), 0.4)))
    assert summary.success.interval == wilson_interval(20, 20)
    assert summary.success.trials == 100


def test_retraining_alone_scatters_less_than_new_scenarios_too():
    generator = np.random.default_rng(0)
    scores = generator.uniform(0.2, 0.6, (1, 30)) + generator.normal(0, 0.01, (5, 30))
    summary = summary_of(table("ppo", scores))
    low, high = summary.score["iqm"].interval
    retrained_low, retrained_high = summary.score_iqm_retrained
    assert low < retrained_low < summary.score["iqm"].value < retrained_high < high
