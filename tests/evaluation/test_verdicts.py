"""Paired differences, and who may be called the winner."""

from __future__ import annotations

import numpy as np
import pytest
from suite_records import suite_records, table

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.statistics.episode_table import tabulate
from defmanip_gym.evaluation.statistics.paired import contrast, difference
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap
from defmanip_gym.evaluation.statistics.scores import score
from defmanip_gym.evaluation.statistics.verdicts import learned_against_analytic, standing

SCENARIOS = 24
DIFFICULTY = np.random.default_rng(0).uniform(-0.15, 0.15, SCENARIOS)


def scores(level, *, members=1, scatter=0.01, seed=0):
    """Return scores about a level that share the scenarios' difficulty."""
    noise = np.random.default_rng(seed).normal(0.0, scatter, (members, SCENARIOS))
    return level + DIFFICULTY + noise


def contestants(**matrices):
    named = {name.replace("_l1", "/l1"): matrix for name, matrix in matrices.items()}
    bootstrap = CrossedBootstrap(("nominal",) * SCENARIOS, resamples=2000)
    tables = tabulate(suite_records(named), "nominal")
    return [score(bootstrap, made) for made in tables]


def test_pairing_separates_what_the_scenarios_scatter_would_hide():
    strong, weak = contestants(ppo=scores(0.42, seed=1), tanner=scores(0.40, seed=2))
    gap = difference(strong, weak)
    assert gap.first_is_better and not gap.second_is_better
    assert difference(weak, strong).second_is_better
    spread = strong.table.scores.std() / np.sqrt(SCENARIOS)
    assert gap.iqm.interval[1] - gap.iqm.interval[0] < spread


def test_a_contestant_does_not_differ_from_itself():
    first, second = contestants(ppo=scores(0.4), sac=scores(0.4))
    gap = difference(first, second)
    assert gap.iqm.interval == (0.0, 0.0)
    assert not gap.first_is_better and not gap.second_is_better


def test_differences_of_shares_stay_among_the_possible_ones():
    apart = np.concatenate([np.full((1, SCENARIOS), 0.9), np.full((1, SCENARIOS), 0.1)])
    ppo, tanner = contestants(ppo=apart, tanner=scores(0.4))
    assert difference(ppo, tanner).iqm.interval == (-1.0, 1.0)


def test_a_higher_iqm_bought_with_failures_is_not_better():
    often_failing = scores(0.55, seed=1)
    often_failing[0, :4] = 0.0
    (fast, safe) = contestants(ppo=often_failing, tanner=scores(0.40, seed=2))
    gap = difference(fast, safe)
    assert gap.iqm.is_positive
    assert not gap.first_is_better


def test_the_winner_is_better_than_every_other_one():
    verdict = standing(
        contestants(zero=0 * scores(0.4), tanner=scores(0.40, seed=1), ppo=scores(0.45, seed=2))
    )
    assert verdict.order == ("ppo", "tanner", "zero")
    assert verdict.winner == "ppo" and verdict.leaders == ("ppo",)
    assert verdict.confidence == pytest.approx(0.975)


def test_no_winner_where_intervals_do_not_separate_the_leading_ones():
    verdict = standing(
        contestants(
            tanner=scores(0.400, scatter=0.05, seed=1),
            ppo=scores(0.401, scatter=0.05, seed=2),
            zero=0 * scores(0.4),
        )
    )
    assert verdict.winner is None
    assert set(verdict.leaders) == {"tanner", "ppo"}


def test_one_member_that_differs_keeps_the_others_from_winning():
    members = scores(0.42, members=5, seed=1)
    members[0] -= 0.1
    verdict = standing(contestants(ppo=members, tanner=scores(0.40, seed=2)))
    assert verdict.winner is None


def test_equal_contestants_seldom_get_a_winner():
    generator = np.random.default_rng(5)
    bootstrap = CrossedBootstrap(("nominal",) * 8, resamples=100)
    winners, trials = 0, 100
    for _ in range(trials):
        matrices = {
            f"ppo-{name}": 0.5
            + generator.normal(0, 0.05, (5, 1))  # what five members differ by is all there is
            + generator.normal(0, 0.01, (5, 8))
            for name in "abcd"
        }
        made = tabulate(suite_records(matrices), "nominal")
        winners += standing([score(bootstrap, entry) for entry in made]).winner is not None
    assert winners / trials <= 0.05


def test_nobody_wins_alone_or_where_nobody_arrives():
    assert standing(contestants(ppo=scores(0.4))).winner is None
    verdict = standing(contestants(ppo=0 * scores(0.4), tanner=0 * scores(0.4)))
    assert verdict.nobody_arrived and verdict.winner is None


def test_single_scenarios_without_members_separate_nobody():
    bootstrap = CrossedBootstrap(("calm", "windy"), resamples=100)
    matrices = {"tanner/l1": np.array([0.5, 0.5]), "tanner": np.array([0.4, 0.4])}
    tables = tabulate(suite_records(matrices, conditions=["calm", "windy"]), "nominal")
    verdict = standing([score(bootstrap, made) for made in tables])
    assert verdict.winner is None and len(verdict.leaders) == 2
    assert verdict.differences[0].iqm.interval is None


@pytest.mark.parametrize(
    ("learned", "analytic", "verdict"),
    [(0.45, 0.40, "learned"), (0.40, 0.45, "analytic"), (0.4001, 0.40, "not separated")],
)
def test_learned_against_analytic_has_three_outcomes(learned, analytic, verdict):
    result = learned_against_analytic(
        contestants(
            ppo=scores(learned, members=5, scatter=0.03, seed=1),
            sac=scores(0.2, members=5, seed=2),
            tanner=scores(analytic, scatter=0.03, seed=3),
            zero=0 * scores(0.4),
        )
    )
    assert result.verdict == verdict
    assert (result.learned, result.analytic, result.pairs) == ("ppo", "tanner", 2)


def test_learned_ones_must_beat_every_analytic_one():
    uncertain = scores(0.40, seed=3)
    uncertain[0, ::3] += 0.2  # slightly worse on average, yet not separated
    uncertain -= uncertain.mean() - 0.41
    result = learned_against_analytic(
        contestants(ppo=scores(0.44, seed=1), tanner=scores(0.42, seed=2), tanner_l1=uncertain)
    )
    assert result.difference.first_is_better  # than the best analytic one
    assert result.verdict == "not separated"


def test_learned_against_analytic_needs_both():
    assert learned_against_analytic(contestants(tanner=scores(0.4), zero=scores(0.4))) is None


def test_contrast_compares_times_where_both_arrived():
    slow = np.full((1, SCENARIOS), 0.25)
    fast = np.full((2, SCENARIOS), 0.5)
    fast[:, 0], fast[0, 1], slow[0, 2] = 0.0, 0.0, 0.0  # both members, one of two, the sole one
    bootstrap = CrossedBootstrap(("nominal",) * SCENARIOS, resamples=200)
    result = contrast(bootstrap, table("ppo", fast), table("tanner", slow))
    assert result.time_s.value == pytest.approx(10.0 - 20.0)
    assert result.success.value == pytest.approx(45 / 48 - 23 / 24)
    assert result.improvement.value == pytest.approx((0 + 0.5 + 22) / 24)


def test_contrast_without_common_successes_has_no_times():
    bootstrap = CrossedBootstrap(("nominal",) * 2, resamples=20)
    first, second = table("ppo", np.array([0.5, 0.0])), table("tanner", np.array([0.0, 0.5]))
    assert contrast(bootstrap, first, second).time_s is None


def test_an_unfinished_evaluation_is_refused():
    records = suite_records({"ppo": scores(0.4, members=2), "tanner": scores(0.4)})
    with pytest.raises(RecordError, match="run the same command again"):
        tabulate(records[1:], "nominal")
    with pytest.raises(RecordError, match="one of each of its 2 members"):
        tabulate([*records, records[0]], "nominal")
