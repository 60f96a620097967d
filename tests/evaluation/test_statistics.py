from __future__ import annotations

import numpy as np
import pytest
from episodes import record

from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.statistics import (
    bootstrap_interval,
    interquartile_mean,
    summarize,
    wilson_interval,
)


# R. G. Newcombe, Statistics in Medicine 17 (1998), Table I, method 3
@pytest.mark.parametrize(
    ("successes", "trials", "published"),
    [(81, 263, (0.2553, 0.3662)), (15, 148, (0.0624, 0.1605)), (0, 20, (0.0, 0.1611))],
)
def test_wilson_interval_has_published_values(successes, trials, published):
    assert wilson_interval(successes, trials) == pytest.approx(published, abs=5e-5)


def test_wilson_interval_refuses_more_successes_than_trials():
    with pytest.raises(ParameterError, match="at most 3 trials"):
        wilson_interval(4, 3)


def test_interquartile_mean_ignores_the_outer_quarters():
    assert interquartile_mean([100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -50.0]) == 3.5


def test_bootstrap_interval_covers_as_often_as_promised():
    generator = np.random.default_rng(1)
    hits = 0
    for _ in range(150):
        low, high = bootstrap_interval(generator.normal(3.0, 1.0, 40), np.mean, resamples=400)
        hits += low <= 3.0 <= high
    assert 0.88 <= hits / 150 <= 0.99


def test_bootstrap_interval_depends_on_the_seed_alone():
    values = [1.0, 2.0, 4.0, 8.0, 16.0]
    first = bootstrap_interval(values, interquartile_mean, resamples=50, seed=1)
    assert first == bootstrap_interval(values, interquartile_mean, resamples=50, seed=1)
    assert first != bootstrap_interval(values, interquartile_mean, resamples=50, seed=2)


def test_bootstrap_interval_refuses_a_single_value():
    with pytest.raises(ParameterError, match="two or more"):
        bootstrap_interval([1.0], np.mean)


def test_summary_counts_each_outcome_and_times_only_successes():
    records = [
        record(scenario="s1", time_to_goal_s=8.0, duration_s=8.0),
        record(scenario="s2", time_to_goal_s=12.0, duration_s=12.0),
        record(
            scenario="s3",
            outcome="violation",
            success=False,
            violated=True,
            largest_swing_share=1.4,
            time_to_goal_s=3.0,
            duration_s=3.0,
        ),
        record(
            scenario="s4", outcome="timeout", success=False, time_to_goal_s=None, duration_s=60.0
        ),
    ]
    (summary,) = summarize(records)
    assert (summary.success.count, summary.success.trials) == (2, 4)
    assert summary.violation.share == 0.25
    assert summary.outcomes["timeout"] == 1
    assert summary.largest_swing_share == 1.4
    assert summary.time_to_goal_median_s == 10.0
    assert summary.interventions is None


def test_summary_without_success_has_no_time_to_goal():
    (summary,) = summarize([record(outcome="timeout", success=False, time_to_goal_s=None)])
    assert summary.time_to_goal_median_s is None
    assert summary.time_to_goal_iqm_s is None


def test_interventions_are_averaged_over_steps_not_episodes():
    (summary,) = summarize(
        [
            record(scenario="s1", duration_s=1.0, interventions=1.0, mean_intervention_m_s2=2.0),
            record(scenario="s2", duration_s=9.0, interventions=0.0, mean_intervention_m_s2=0.0),
        ]
    )
    assert summary.interventions == pytest.approx(0.1)
    assert summary.mean_intervention_m_s2 == pytest.approx(0.2)
