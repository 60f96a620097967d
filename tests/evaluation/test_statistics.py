"""Aggregates, intervals and bootstraps, against published formulas and rliable's numbers."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize, stats

from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.statistics import aggregates
from defmanip_gym.evaluation.statistics.improvement import probability_of_improvement
from defmanip_gym.evaluation.statistics.intervals import percentile_interval, wilson_interval
from defmanip_gym.evaluation.statistics.profiles import performance_profile, score_distribution
from defmanip_gym.evaluation.statistics.resampling import (
    CrossedBootstrap,
    Sample,
    stratified_draws,
)

RLIABLE = json.loads(Path(__file__).with_name("data").joinpath("rliable.json").read_text())
SCORES = {name: np.array(values) for name, values in RLIABLE["scores"].items()}
AGGREGATES = {
    "interquartile_mean": aggregates.interquartile_mean,
    "mean": aggregates.mean,
    "median": aggregates.median,
    "optimality_gap": aggregates.optimality_gap,
    "optimality_gap_0_6": partial(aggregates.optimality_gap, threshold=0.6),
}
# R = 20,000 draws put the 2.5 % quantile within 1.4 times this share of the scatter (one standard
# error, for a normal distribution); four of them cover both sides' errors.
_QUANTILE_TOLERANCE = 4 * np.sqrt(0.025 * 0.975 / 20_000) / stats.norm.pdf(stats.norm.ppf(0.025))


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


@pytest.mark.parametrize("name", AGGREGATES)
@pytest.mark.parametrize("algorithm", SCORES)
def test_aggregates_equal_rliables(name, algorithm):
    value = AGGREGATES[name](SCORES[algorithm])
    assert value == pytest.approx(RLIABLE["points"][name][algorithm], abs=1e-12)


@pytest.mark.parametrize("name", AGGREGATES)
@pytest.mark.parametrize("algorithm", SCORES)
def test_stratified_bootstrap_gives_rliables_intervals(name, algorithm):
    draws = stratified_draws(SCORES[algorithm], AGGREGATES[name], resamples=20_000)
    expected = RLIABLE["intervals"][name][algorithm]
    assert percentile_interval(draws) == pytest.approx(
        expected, abs=_QUANTILE_TOLERANCE * draws.std()
    )


def test_probability_of_improvement_equals_rliables():
    value = probability_of_improvement(SCORES["first"], SCORES["second"])
    assert value == pytest.approx(RLIABLE["improvement"]["point"], abs=1e-12)


def test_probability_of_improvement_is_mann_whitneys_with_ties_as_halves():
    first, second = np.array([[1.0], [2.0], [2.0]]), np.array([[2.0], [0.0]])
    u = stats.mannwhitneyu(first[:, 0], second[:, 0]).statistic
    assert probability_of_improvement(first, second) == u / 6 == pytest.approx(4 / 6)


@pytest.mark.parametrize("algorithm", SCORES)
def test_performance_profile_equals_rliables(algorithm):
    profile = RLIABLE["profiles"]
    thresholds = np.array(profile["thresholds"])
    shares = score_distribution(SCORES[algorithm], thresholds)
    np.testing.assert_allclose(shares, profile["points"][algorithm], atol=1e-12)
    draws = stratified_draws(
        SCORES[algorithm], partial(score_distribution, thresholds=thresholds), resamples=20_000
    )
    band = np.quantile(draws, (0.025, 0.975), axis=0)
    one_episode = 1 / SCORES[algorithm].size  # shares are multiples of it
    assert np.abs(band - profile["bands"][algorithm]).max() <= one_episode + 1e-12


def test_score_distribution_counts_scores_strictly_above_each_threshold():
    shares = score_distribution(np.array([[0.0, 0.5], [0.5, 1.0]]), np.array([0.0, 0.5, 1.0]))
    assert shares.tolist() == [0.75, 0.25, 0.0]


def test_interquartile_mean_leaves_out_episodes_without_a_value():
    with_gaps = np.array([[np.nan, 100.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, -50.0, np.nan]])
    assert aggregates.interquartile_mean(with_gaps) == 3.5
    assert np.isnan(aggregates.interquartile_mean(np.full((2, 3), np.nan)))


@pytest.mark.parametrize("share", [0.1, 0.25, 0.3])
def test_conditional_value_at_risk_is_rockafellars_and_uryasevs_minimum(share):
    values = np.random.default_rng(0).gamma(2.0, size=(3, 7))

    def objective(threshold):
        return threshold + np.maximum(values - threshold, 0.0).mean() / share

    minimum = min(objective(value) for value in values.ravel())  # reached at one of them
    assert minimum <= optimize.minimize_scalar(objective).fun + 1e-9
    assert aggregates.conditional_value_at_risk(values, share) == pytest.approx(minimum)


def test_crossed_bootstrap_covers_the_mean_over_new_members_and_new_scenarios():
    generator = np.random.default_rng(1)
    hits, trials = 0, 200
    for _ in range(trials):
        members, scenarios = generator.normal(0, 0.5, (8, 1)), generator.normal(0, 1.0, (1, 24))
        scores = members + scenarios + generator.normal(0, 1.0, (8, 24))
        bootstrap = CrossedBootstrap(("s",) * 24, resamples=300)
        low, high = percentile_interval(bootstrap.draws(aggregates.mean, Sample("a", scores)))
        hits += low <= 0.0 <= high
    assert 0.9 <= hits / trials <= 0.99


def test_crossed_bootstrap_draws_scenarios_within_their_condition():
    bootstrap = CrossedBootstrap(("calm", "calm", "windy", "calm"), resamples=200)
    drawn = bootstrap.scenarios
    assert set(drawn[:, 2]) == {2}
    assert set(np.delete(drawn, 2, axis=1).ravel()) == {0, 1, 3}


def test_crossed_bootstrap_gives_all_contestants_the_same_scenarios():
    scores = np.random.default_rng(2).uniform(size=(1, 30))
    bootstrap = CrossedBootstrap(("s",) * 30, resamples=100)
    first = bootstrap.draws(aggregates.mean, Sample("a", scores))
    second = bootstrap.draws(aggregates.mean, Sample("b", scores + 0.25))
    np.testing.assert_allclose(second - first, 0.25)


def test_a_contestants_draws_depend_on_its_name_alone():
    scores = np.random.default_rng(3).uniform(size=(5, 1))
    bootstrap = CrossedBootstrap(("s",), resamples=50)
    draws = bootstrap.draws(aggregates.mean, Sample("a", scores))
    np.testing.assert_array_equal(
        draws, CrossedBootstrap(("s",), resamples=50).draws(aggregates.mean, Sample("a", scores))
    )
    assert (draws != bootstrap.draws(aggregates.mean, Sample("b", scores))).any()


def test_chunks_do_not_change_the_draws(monkeypatch):
    scores = np.random.default_rng(4).uniform(size=(3, 10))
    bootstrap = CrossedBootstrap(("s",) * 10, resamples=50)
    whole = bootstrap.draws(aggregates.interquartile_mean, Sample("a", scores))
    monkeypatch.setattr("defmanip_gym.evaluation.statistics.resampling._CHUNK", 70)
    parts = bootstrap.draws(aggregates.interquartile_mean, Sample("a", scores))
    np.testing.assert_array_equal(whole, parts)


def test_bootstraps_refuse_what_they_cannot_resample():
    with pytest.raises(ParameterError, match="two or more"):
        stratified_draws(np.ones((1, 5)), aggregates.mean)
    with pytest.raises(ParameterError, match="the 3 of the suite"):
        CrossedBootstrap(("s",) * 3).draws(aggregates.mean, Sample("a", np.ones((2, 4))))


def test_intervals_leave_out_resamples_without_a_value():
    draws = np.array([np.nan, 1.0, 1.0, np.nan])
    assert percentile_interval(draws) == (1.0, 1.0)
    assert percentile_interval(draws * np.nan) is None


def test_profile_bands_hold_the_profile():
    scores = np.random.default_rng(5).uniform(size=(4, 25))
    bootstrap = CrossedBootstrap(("s",) * 25, resamples=300)
    profile = performance_profile(bootstrap, Sample("a", scores), np.linspace(0, 1, 11))
    assert (profile.low <= profile.shares).all() and (profile.shares <= profile.high).all()
    assert (profile.high - profile.low).max() > 0.1
