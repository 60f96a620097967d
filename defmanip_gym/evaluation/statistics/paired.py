"""Paired differences between contestants on the same scenarios."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.evaluation.statistics.aggregates import Array, mean
from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable
from defmanip_gym.evaluation.statistics.improvement import probability_of_improvement
from defmanip_gym.evaluation.statistics.intervals import (
    CONFIDENCE,
    Estimate,
    percentile_interval,
)
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap, Sample
from defmanip_gym.evaluation.statistics.scores import Scores


@dataclass(frozen=True, kw_only=True)
class Difference:
    """By how much the scores of one contestant exceed another's.

    The interquartile mean alone forgets the worst quarter of the episodes, failures among them,
    and the mean alone follows outliers. One contestant is better only where the intervals of both
    differences lie above zero. Asking for both needs no correction.

    Attributes:
        first: name.
        second: name.
        iqm: difference of the interquartile means.
        mean: difference of the means.
        confidence: of the intervals.
    """

    first: str
    second: str
    iqm: Estimate
    mean: Estimate
    confidence: float

    @property
    def first_is_better(self) -> bool:
        """Whether both intervals lie above zero."""
        return self.iqm.is_positive and self.mean.is_positive

    @property
    def second_is_better(self) -> bool:
        """Whether both intervals lie below zero."""
        return self.iqm.is_negative and self.mean.is_negative


@dataclass(frozen=True, kw_only=True)
class Contrast:
    """What two contestants differ by besides scores; intervals from the crossed bootstrap.

    Attributes:
        success: difference of success rates.
        time_s: mean difference of the times to the goal, over scenarios in which both arrived;
            None without any.
        improvement: P(first > second) in score on the same scenario, ties one half.
    """

    success: Estimate
    time_s: Estimate | None
    improvement: Estimate


def difference(first: Scores, second: Scores, confidence: float = CONFIDENCE) -> Difference:
    """Return the paired difference of two contestants of one suite.

    Args:
        first: from the same bootstrap as ``second``.
        second: likewise.
        confidence: of the intervals; a family of n comparisons wants 1 − 0.05/n each.
    """
    return Difference(
        first=first.contestant,
        second=second.contestant,
        iqm=first.difference(second, "iqm", confidence),
        mean=first.difference(second, "mean", confidence),
        confidence=confidence,
    )


def contrast(bootstrap: CrossedBootstrap, first: EpisodeTable, second: EpisodeTable) -> Contrast:
    """Return what two contestants differ by besides scores."""
    resamplable = varies(first) or varies(second)

    def estimate(statistic, ours: Array, theirs: Array) -> Estimate:  # type: ignore[no-untyped-def]
        draws = bootstrap.draws(
            statistic, Sample(first.contestant, ours), Sample(second.contestant, theirs)
        )
        return Estimate(
            value=float(statistic(ours, theirs)),
            interval=percentile_interval(draws) if resamplable else None,
        )

    time_s = estimate(_mean_time_difference, first.times_to_goal, second.times_to_goal)
    return Contrast(
        success=estimate(lambda a, b: mean(a) - mean(b), first.successes, second.successes),
        time_s=time_s if np.isfinite(time_s.value) else None,
        improvement=estimate(probability_of_improvement, first.scores, second.scores),
    )


def varies(table: EpisodeTable) -> bool:
    """Whether a contestant has anything to resample: several members, or scenarios alike."""
    return len(table.members) > 1 or len(set(table.conditions)) < len(table.conditions)


def _mean_time_difference(first: Array, second: Array) -> Array:
    """Return the mean over scenarios, (...), of differences of the members' mean times."""
    gap = _mean_of_members(first) - _mean_of_members(second)
    return mean(gap[..., None, :])


def _mean_of_members(values: Array) -> Array:
    """Return the mean of the finite values of each column, (..., S); NaN where there is none."""
    return mean(np.swapaxes(values, -2, -1)[..., None])
