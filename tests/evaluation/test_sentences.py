"""What the report claims in words."""

from __future__ import annotations

import numpy as np
import pytest
from suite_records import suite_records

from defmanip_gym.evaluation.analysis import analyse
from defmanip_gym.evaluation.report.sentences import answer, headline, suite_claims

SCENARIOS = 24
DIFFICULTY = np.random.default_rng(0).uniform(-0.15, 0.15, SCENARIOS)


def scores(level, seed, members=1):
    noise = np.random.default_rng(seed).normal(0.0, 0.02, (members, SCENARIOS))
    return level + DIFFICULTY + noise


def analysis_of(matrices, **options):
    records = suite_records(matrices, **options)
    certified = [name for name in matrices if "/" in name]
    return analyse(records, "nominal", order=list(matrices), certified=certified)


def text_of(matrices, **options):
    return " ".join(claim.text for claim in suite_claims(analysis_of(matrices, **options)))


def test_a_winner_is_named_with_its_success_and_violations():
    matrices = {"ppo": scores(0.45, 1, 5), "tanner": scores(0.40, 2), "zero": np.zeros(SCENARIOS)}
    text = text_of(matrices)
    assert "Among all contestants, ppo is best: its score of 0.4" in text
    assert "each of the other 2, next tanner by +0.0" in text
    assert "succeeds in 100 % and exceeds σ in 0 %" in text
    assert headline(analysis_of(matrices).overall) == "best: ppo"


def test_the_leading_ones_are_named_where_nobody_wins():
    matrices = {
        "ppo": scores(0.400, 1),
        "tanner": scores(0.401, 2),
        "zero": np.zeros(SCENARIOS),
    }
    text = text_of(matrices)
    assert "nobody is best: the intervals do not separate" in text
    assert "tanner (0." in text and "ppo (0." in text and "zero" not in text


@pytest.mark.parametrize(
    ("learned", "claim"),
    [
        (0.45, "learning beats the analytic controllers: ppo scores higher than every one"),
        (0.35, "no learned contestant beats the best analytic one: tanner scores higher than ev"),
        (0.40, "no learned contestant beats the best analytic one as far as intervals show"),
    ],
)
@pytest.mark.parametrize(
    ("suffix", "label"), [("", "Without a filter"), ("/l1", "Inside a filter")]
)
def test_whether_learning_beats_analysis_is_always_said(learned, claim, suffix, label):
    matrices = {f"ppo{suffix}": scores(learned, 1, 5), f"tanner{suffix}": scores(0.40, 2)}
    claim = claim.replace("ppo", f"ppo{suffix}").replace("tanner", f"tanner{suffix}")
    assert f"{label}, {claim}"[:90] in text_of(matrices)


@pytest.mark.parametrize(
    ("learned", "claim"),
    [
        (0.45, "Learning adds something on nominal,"),
        (
            0.35,
            "Learning adds nothing that intervals show",
        ),
        (0.40, "On nominal intervals do not separate them"),
    ],
)
def test_the_answer_says_where_learning_adds_something(learned, claim):
    matrices = {"ppo": scores(learned, 1, 5), "tanner": scores(0.40, 2)}
    assert claim in answer([analysis_of(matrices)])


def test_beating_some_analytic_contestants_only_is_not_called_a_win():
    uncertain = scores(0.40, 3)
    uncertain[0, ::3] += 0.2
    uncertain -= uncertain.mean() - 0.41
    text = text_of({"ppo": scores(0.44, 1), "tanner": scores(0.42, 2), "tanner-b": uncertain})
    assert "no learned contestant beats all analytic ones, nor the reverse" in text


def test_details_compare_success_and_time_with_intervals():
    claims = suite_claims(analysis_of({"ppo": scores(0.45, 1, 5), "tanner": scores(0.40, 2)}))
    (detail,) = (claim.detail for claim in claims if claim.detail)
    assert detail.startswith("ppo minus tanner: success 0 percentage points, time to the goal −")
    assert "[" in detail and "scores higher with probability" in detail


def test_nobody_is_praised_where_nobody_arrives():
    nothing = np.zeros(SCENARIOS)
    matrices = {"ppo": nothing, "tanner": nothing}
    text = text_of(matrices)
    assert "Among all contestants, nobody reached the goal within σ." in text
    assert "Without a filter, neither learned nor analytic contestants reached" in text
    assert headline(analysis_of(matrices).overall) == "nobody reached the goal within σ"


def test_single_runs_of_single_scenarios_carry_no_claim():
    matrices = {"ppo": np.array([0.5, 0.5]), "tanner": np.array([0.4, 0.4])}
    conditions = ["calm", "windy"]
    text = text_of(matrices, conditions=conditions)
    assert "nobody can be called best: ppo scores highest (0.500)" in text
    assert "Without a filter, nothing is claimed: ppo differs from tanner by +0.100" in text
    analysis = analysis_of(matrices, conditions=conditions)
    assert headline(analysis.overall) == "highest, without intervals: ppo"


def test_long_lists_of_leaders_are_cut():
    matrices = {f"ppo-{letter}": scores(0.4, ord(letter)) for letter in "abcdefghi"}
    assert "and 3 more" in headline(analysis_of(matrices).overall)
