"""Score aggregates of a contestant, with an uncertainty that holds for a handful of members."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.evaluation.statistics.aggregates import SCORE_AGGREGATES, Array
from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable
from defmanip_gym.evaluation.statistics.intervals import (
    CONFIDENCE,
    Estimate,
    Interval,
    VarianceComponent,
    welch_interval,
)
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap, Sample

_NAMES = tuple(SCORE_AGGREGATES)


@dataclass(frozen=True, kw_only=True)
class Scores:
    """A contestant's score aggregates and what they would vary by.

    Percentiles of a bootstrap never leave what five members did: by chance alone all five of them
    are above a truth in one case of 32, never as rarely as a correction for many comparisons asks.
    So the variance due to members is estimated by the jackknife over them, with M − 1 degrees of
    freedom, that due to scenarios by the bootstrap within conditions, and intervals are Welch's.
    What single episodes contribute is in both, which errs on the safe side. Members of two
    contestants count as independent also where they are the same agents, without and with a
    certificate; that too errs on the safe side.

    Attributes:
        table: the contestant's episodes.
        point: aggregates in the order of ``SCORE_AGGREGATES``, (A,).
        draws: the same over resampled scenarios, shared by the suite's contestants, (R, A).
        member_variance: of the aggregates, due to the choice of members, (A,); zero for one.
    """

    table: EpisodeTable
    point: Array
    draws: Array
    member_variance: Array

    @property
    def contestant(self) -> str:
        """Its name."""
        return self.table.contestant

    @property
    def iqm(self) -> float:
        """Interquartile mean of the scores."""
        return float(self.point[_NAMES.index("iqm")])

    def estimate(self, aggregate: str, confidence: float = CONFIDENCE) -> Estimate:
        """Return an aggregate of ``SCORE_AGGREGATES`` with its interval."""
        index = _NAMES.index(aggregate)
        components = _components(self.table, self.draws[:, index], self._due_to_members(index))
        value = float(self.point[index])
        interval = welch_interval(value, components, confidence)
        return Estimate(value=value, interval=_within(interval, value, 0.0))

    def difference(self, other: Scores, aggregate: str, confidence: float = CONFIDENCE) -> Estimate:
        """Return by how much an aggregate exceeds another contestant's on the same scenarios.

        Args:
            other: from the same bootstrap.
            aggregate: a name in ``SCORE_AGGREGATES``.
            confidence: of the interval.
        """
        index = _NAMES.index(aggregate)
        members = [*self._due_to_members(index), *other._due_to_members(index)]
        draws = self.draws[:, index] - other.draws[:, index]
        value = float(self.point[index] - other.point[index])
        interval = welch_interval(value, _components(self.table, draws, members), confidence)
        return Estimate(value=value, interval=_within(interval, value, -1.0))

    def _due_to_members(self, index: int) -> list[VarianceComponent]:
        count = len(self.table.members)
        if count < 2:
            return []
        return [VarianceComponent(float(self.member_variance[index]), count - 1)]


def _within(interval: Interval | None, value: float, lowest: float) -> Interval | None:
    """Cut an interval to what scores, which are shares of a limit, or differences can be."""
    if interval is None:
        return None
    return max(interval[0], min(value, lowest)), min(interval[1], max(value, 1.0))


def score(bootstrap: CrossedBootstrap, table: EpisodeTable) -> Scores:
    """Return a contestant's score aggregates; the bootstrap is of its suite."""
    values = table.scores
    return Scores(
        table=table,
        point=_aggregates(values),
        draws=bootstrap.draws_of_scenarios(_aggregates, Sample(table.contestant, values)),
        member_variance=_jackknife_variance(values),
    )


def _aggregates(values: Array) -> Array:
    return np.stack([aggregate(values) for aggregate in SCORE_AGGREGATES.values()], axis=-1)


def _jackknife_variance(values: Array) -> Array:
    """Return the aggregates' variance from leaving out one member at a time, (A,)."""
    count = len(values)
    if count < 2:
        return np.zeros(len(SCORE_AGGREGATES))
    without = np.stack([_aggregates(np.delete(values, member, axis=0)) for member in range(count)])
    return np.asarray((count - 1) * without.var(axis=0))


def _components(
    table: EpisodeTable, draws: Array, members: list[VarianceComponent]
) -> list[VarianceComponent]:
    """Return all sources of variance; scenarios are none where each has its own condition."""
    count, strata = len(table.scenarios), len(set(table.conditions))
    freedom = count - strata
    if not freedom:
        return members
    return [VarianceComponent(float(draws.var()) * count / freedom, freedom), *members]
