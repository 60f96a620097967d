"""Who is best, where intervals allow to say so, and whether learning beats analysis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from defmanip_gym.evaluation.statistics.intervals import CONFIDENCE
from defmanip_gym.evaluation.statistics.paired import Difference, difference
from defmanip_gym.evaluation.statistics.scores import Scores

Verdict = Literal["learned", "analytic", "not separated"]


@dataclass(frozen=True, kw_only=True)
class Standing:
    """The best of a class of contestants, if there is one.

    A winner is better than every other contestant, each difference at a Bonferroni-corrected
    confidence: k − 1 comparisons for k contestants. That the winner was chosen by the same data
    costs nothing more. A wrong winner must seem better than the truly best one, and only k − 1
    comparisons can go wrong that way.

    Attributes:
        order: the class by descending interquartile mean of the score.
        winner: None where the intervals do not separate it from all others.
        leaders: the first of the order and those not separated from it.
        differences: of the first from each other one, in order.
        confidence: of each difference.
        nobody_arrived: whether all scores are zero.
    """

    order: tuple[str, ...]
    winner: str | None
    leaders: tuple[str, ...]
    differences: tuple[Difference, ...]
    confidence: float
    nobody_arrived: bool


@dataclass(frozen=True, kw_only=True)
class LearnedAgainstAnalytic:
    """Whether learned contestants beat analytic ones.

    Learned ones are better only if one of them is better than *every* analytic one, and the
    reverse. All L × A pairs share the error, which covers that the best are chosen by the data.

    Attributes:
        verdict: who is better.
        learned: the learned contestant with the highest interquartile mean of the score.
        analytic: the analytic one.
        difference: learned minus analytic of these two.
        pairs: how many comparisons share the error.
        nobody_arrived: whether all scores are zero.
    """

    verdict: Verdict
    learned: str
    analytic: str
    difference: Difference
    pairs: int
    nobody_arrived: bool


def standing(contestants: Sequence[Scores]) -> Standing:
    """Return who leads a class of at least one contestant, all from one bootstrap."""
    ranked = _ranked(contestants)
    first, others = ranked[0], ranked[1:]
    confidence = _corrected(len(others))
    differences = tuple(difference(first, other, confidence) for other in others)
    behind = {d.second for d in differences if d.first_is_better}
    leaders = tuple(c.contestant for c in ranked if c.contestant not in behind)
    return Standing(
        order=tuple(c.contestant for c in ranked),
        winner=first.contestant if others and len(leaders) == 1 else None,
        leaders=leaders,
        differences=differences,
        confidence=confidence,
        nobody_arrived=_nobody_arrived(ranked),
    )


def learned_against_analytic(
    contestants: Sequence[Scores],
) -> LearnedAgainstAnalytic | None:
    """Return how learned contestants stand against analytic ones; None without either kind."""
    ranked = _ranked(contestants)
    learned = [c for c in ranked if c.table.family == "learned"]
    analytic = [c for c in ranked if c.table.family == "analytic"]
    if not learned or not analytic:
        return None
    pairs = len(learned) * len(analytic)
    confidence = _corrected(pairs)
    verdict: Verdict = "not separated"
    if all(difference(learned[0], other, confidence).first_is_better for other in analytic):
        verdict = "learned"
    elif all(difference(other, analytic[0], confidence).second_is_better for other in learned):
        verdict = "analytic"
    return LearnedAgainstAnalytic(
        verdict=verdict,
        learned=learned[0].contestant,
        analytic=analytic[0].contestant,
        difference=difference(learned[0], analytic[0], confidence),
        pairs=pairs,
        nobody_arrived=_nobody_arrived([*learned, *analytic]),
    )


def _nobody_arrived(contestants: Sequence[Scores]) -> bool:
    return not any(contestant.table.scores.any() for contestant in contestants)


def _ranked(contestants: Sequence[Scores]) -> list[Scores]:
    return sorted(contestants, key=lambda contestant: -contestant.iqm)


def _corrected(comparisons: int) -> float:
    """Return Bonferroni's confidence of each of some comparisons."""
    return 1.0 - (1.0 - CONFIDENCE) / max(comparisons, 1)
