"""One contestant's row of a suite's table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from defmanip_gym.evaluation.entry import Family
from defmanip_gym.evaluation.optimum import optimum_share
from defmanip_gym.evaluation.records import EpisodeRecord, Outcome
from defmanip_gym.evaluation.statistics.aggregates import (
    SCORE_AGGREGATES,
    Aggregate,
    Array,
    conditional_value_at_risk,
    interquartile_mean,
    mean,
)
from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable, Reading
from defmanip_gym.evaluation.statistics.intervals import (
    Estimate,
    Interval,
    Rate,
    percentile_interval,
    wilson_interval,
)
from defmanip_gym.evaluation.statistics.paired import varies
from defmanip_gym.evaluation.statistics.resampling import (
    CrossedBootstrap,
    Sample,
    stratified_draws,
)
from defmanip_gym.evaluation.statistics.scores import Scores


@dataclass(frozen=True, kw_only=True)
class Summary:
    """One contestant in one suite. Intervals are the crossed bootstrap's unless said otherwise.

    Rates carry the wider of Wilson's interval and the bootstrap's, which has no width where all
    members agree in every scenario. Wilson's trials are the scenarios: episodes of several members
    on one are not independent.

    Attributes:
        contestant: name.
        family: what kind of controller it is.
        members: how many.
        score: aggregates by name, as in ``SCORE_AGGREGATES``, with the intervals of ``Scores``.
        optimum_share: T*/T, 0 without success; interquartile mean; None where T* is not known.
        score_iqm_retrained: interval of the interquartile mean over retraining on these very
            scenarios (stratified bootstrap); None for one member.
        success: goal reached and σ never exceeded.
        violation: σ exceeded.
        outcomes: number of episodes by outcome, all outcomes present.
        largest_swing_share: max ‖z2‖∞ / σ over all episodes.
        swing_share_cvar: mean of the worst tenth of the episodes' max ‖z2‖∞ / σ.
        time_to_goal_s: interquartile mean over successful episodes; None without any.
        path_length_m: likewise.
        energy_j: likewise.
        force_error_n: interquartile mean over all episodes.
        peak_grasp_force_n: largest over all episodes.
        final_distance_m: median over all episodes.
        interventions: share of all steps; None without wrapper.
        mean_intervention_m_s2: over all steps; None without wrapper.
        certificate_applies: share of episodes whose plant and start meet the certificate's
            conditions; None without certificate.
    """

    contestant: str
    family: Family
    members: int
    score: Mapping[str, Estimate]
    optimum_share: Estimate | None
    score_iqm_retrained: Interval | None
    success: Rate
    violation: Rate
    outcomes: Mapping[Outcome, int]
    largest_swing_share: float
    swing_share_cvar: Estimate
    time_to_goal_s: Estimate | None
    path_length_m: Estimate | None
    energy_j: Estimate | None
    force_error_n: Estimate
    peak_grasp_force_n: float
    final_distance_m: float
    interventions: float | None
    mean_intervention_m_s2: float | None
    certificate_applies: float | None


def summarize(bootstrap: CrossedBootstrap, scores: Scores) -> Summary:
    """Return a contestant's summary; the bootstrap is of its suite."""
    table = scores.table
    records = table.records
    swing = table.values(lambda record: record.largest_swing_share)
    applies = [r.certificate_applies for r in records if r.certificate_applies is not None]
    return Summary(
        contestant=table.contestant,
        family=table.family,
        members=len(table.members),
        score={name: scores.estimate(name) for name in SCORE_AGGREGATES},
        optimum_share=_known(bootstrap, table, optimum_share),
        score_iqm_retrained=_retrained(bootstrap, table),
        success=success_rate(bootstrap, table),
        violation=_rate(bootstrap, table, table.values(lambda record: record.violated)),
        outcomes={
            outcome: sum(record.outcome == outcome for record in records)
            for outcome in get_args(Outcome)
        },
        largest_swing_share=float(swing.max()),
        swing_share_cvar=_estimate(bootstrap, table, swing, conditional_value_at_risk),
        time_to_goal_s=_of_successes(bootstrap, table, lambda record: record.time_to_goal_s),
        path_length_m=_of_successes(bootstrap, table, lambda record: record.path_length_m),
        energy_j=_of_successes(bootstrap, table, lambda record: record.energy_j),
        force_error_n=_estimate(
            bootstrap,
            table,
            table.values(lambda record: record.force_error_n),
            interquartile_mean,
        ),
        peak_grasp_force_n=max(record.peak_grasp_force_n for record in records),
        final_distance_m=float(np.median([record.final_distance_m for record in records])),
        interventions=_mean_over_steps(table, lambda record: record.interventions),
        mean_intervention_m_s2=_mean_over_steps(
            table, lambda record: record.mean_intervention_m_s2
        ),
        certificate_applies=float(np.mean(applies)) if applies else None,
    )


def success_rate(bootstrap: CrossedBootstrap, table: EpisodeTable) -> Rate:
    """Return how often the goal was reached without ever exceeding σ; see ``Summary``."""
    return _rate(bootstrap, table, table.successes)


def _retrained(bootstrap: CrossedBootstrap, table: EpisodeTable) -> Interval | None:
    if len(table.members) < 2:
        return None
    draws = stratified_draws(table.scores, interquartile_mean, resamples=bootstrap.resamples)
    return percentile_interval(draws)


def _estimate(
    bootstrap: CrossedBootstrap, table: EpisodeTable, values: Array, aggregate: Aggregate
) -> Estimate:
    interval = None
    if varies(table):
        draws = bootstrap.draws(aggregate, Sample(table.contestant, values))
        interval = percentile_interval(draws)
    return Estimate(value=float(aggregate(values)), interval=interval)


def _of_successes(
    bootstrap: CrossedBootstrap, table: EpisodeTable, reading: Reading
) -> Estimate | None:
    """Return an interquartile mean over successful episodes, None without any."""

    def only_successes(record: EpisodeRecord) -> float | None:
        return reading(record) if record.success else None

    return _known(bootstrap, table, only_successes)


def _known(bootstrap: CrossedBootstrap, table: EpisodeTable, reading: Reading) -> Estimate | None:
    """Return an interquartile mean over the episodes that have a value, None without any."""
    values = table.values(reading)
    if not np.isfinite(values).any():
        return None
    return _estimate(bootstrap, table, values, interquartile_mean)


def _rate(bootstrap: CrossedBootstrap, table: EpisodeTable, flags: Array) -> Rate:
    count = int(flags.sum())
    members, scenarios = flags.shape
    low, _ = wilson_interval(count // members, scenarios)
    _, high = wilson_interval(-(-count // members), scenarios)
    if members > 1:
        crossed = percentile_interval(bootstrap.draws(mean, Sample(table.contestant, flags)))
        if crossed is not None:
            low, high = min(low, crossed[0]), max(high, crossed[1])
    return Rate(count=count, trials=flags.size, interval=(low, high))


def _mean_over_steps(table: EpisodeTable, reading: Reading) -> float | None:
    """Weight episodes by their length, so that every step counts the same."""
    pairs = [(reading(record), record.duration_s) for record in table.records]
    known = [(value, weight) for value, weight in pairs if value is not None]
    if not known:
        return None
    values, weights = zip(*known, strict=True)
    return float(np.average(values, weights=weights))
