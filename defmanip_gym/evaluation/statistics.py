"""Statistics of a comparison, from records alone; SciPy does the mathematics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.records import EpisodeRecord, Outcome
from defmanip_gym.validation import require_between, require_whole

Array = NDArray[np.float64]
Interval = tuple[float, float]
Statistic = Callable[..., Any]

CONFIDENCE = 0.95
RESAMPLES = 10_000
_BOOTSTRAP_SEED = 0  # the same records give the same report


def wilson_interval(successes: int, trials: int, confidence: float = CONFIDENCE) -> Interval:
    """Return the score interval of a rate; honest at 0 % and 100 %, unlike the normal one.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference",
    J. Am. Stat. Assoc. 22 (1927).

    Raises:
        ParameterError: no trials, or successes not among them.
    """
    require_whole("trials", trials, 1)
    require_whole("successes", successes, 0)
    require_between("confidence", confidence, 0.0, 1.0)
    if successes > trials:
        raise ParameterError("successes", successes, f"at most {trials} trials", "Count again.")
    interval = stats.binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    return float(interval.low), float(interval.high)


def interquartile_mean(values: Sequence[float] | Array, axis: int = 0) -> Any:
    """Return the mean of the middle half: robust like the median, with less scatter.

    R. Agarwal et al., "Deep reinforcement learning at the edge of the statistical precipice",
    NeurIPS 2021.

    Args:
        values: samples along ``axis``.
        axis: the one to average over.
    """
    return stats.trim_mean(np.asarray(values, dtype=np.float64), 0.25, axis=axis)


def bootstrap_interval(
    values: Sequence[float] | Array,
    statistic: Statistic,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = _BOOTSTRAP_SEED,
) -> Interval:
    """Return the percentile bootstrap interval of a statistic.

    Args:
        values: independent samples, at least two.
        statistic: takes an array and ``axis``.
        confidence: between 0 and 1.
        resamples: how many times to resample.
        seed: equal seeds give equal intervals.

    Raises:
        ParameterError: fewer than two values.
    """
    require_between("confidence", confidence, 0.0, 1.0)
    require_whole("resamples", resamples, 1)
    if len(values) < 2:
        raise ParameterError("values", values, "two or more", "One value has no scatter.")
    result = stats.bootstrap(
        (np.asarray(values, dtype=np.float64),),
        statistic,
        confidence_level=confidence,
        n_resamples=resamples,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(seed),
    )
    return float(result.confidence_interval.low), float(result.confidence_interval.high)


@dataclass(frozen=True, kw_only=True)
class Rate:
    """How many of the trials, with its Wilson interval."""

    count: int
    trials: int
    interval: Interval

    @property
    def share(self) -> float:
        """The rate itself."""
        return self.count / self.trials


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """An interquartile mean with its bootstrap interval, None for a single value."""

    value: float
    interval: Interval | None


@dataclass(frozen=True, kw_only=True)
class Summary:
    """One contestant's row of the table.

    Attributes:
        contestant: name.
        success: goal reached and σ never exceeded.
        violation: σ exceeded.
        outcomes: number of episodes by outcome, all outcomes present.
        largest_swing_share: max ‖z2‖∞ / σ over all episodes.
        time_to_goal_median_s: over successful episodes; None without any.
        time_to_goal_iqm_s: over successful episodes; None without any.
        start_distance_m: median over all episodes.
        final_distance_m: median over all episodes.
        peak_grasp_force_n: largest over all episodes.
        energy_j: interquartile mean over all episodes.
        interventions: share of all steps; None without wrapper.
        mean_intervention_m_s2: over all steps; None without wrapper.
    """

    contestant: str
    success: Rate
    violation: Rate
    outcomes: Mapping[Outcome, int]
    largest_swing_share: float
    time_to_goal_median_s: float | None
    time_to_goal_iqm_s: Estimate | None
    start_distance_m: float
    final_distance_m: float
    peak_grasp_force_n: float
    energy_j: Estimate
    interventions: float | None
    mean_intervention_m_s2: float | None


def summarize(records: Iterable[EpisodeRecord]) -> tuple[Summary, ...]:
    """Return a summary per contestant, in the order in which they first appear."""
    groups: dict[str, list[EpisodeRecord]] = {}
    for record in records:
        groups.setdefault(record.contestant, []).append(record)
    return tuple(_summary(name, group) for name, group in groups.items())


def _summary(contestant: str, records: Sequence[EpisodeRecord]) -> Summary:
    times = [record.duration_s for record in records if record.success]
    wrapped = [record for record in records if record.interventions is not None]
    return Summary(
        contestant=contestant,
        success=_rate([record.success for record in records]),
        violation=_rate([record.violated for record in records]),
        outcomes={
            outcome: sum(record.outcome == outcome for record in records)
            for outcome in get_args(Outcome)
        },
        largest_swing_share=max(record.largest_swing_share for record in records),
        time_to_goal_median_s=float(np.median(times)) if times else None,
        time_to_goal_iqm_s=_estimate(times) if times else None,
        start_distance_m=float(np.median([record.start_distance_m for record in records])),
        final_distance_m=float(np.median([record.final_distance_m for record in records])),
        peak_grasp_force_n=max(record.peak_grasp_force_n for record in records),
        energy_j=_estimate([record.energy_j for record in records]),
        interventions=_mean_over_steps(wrapped, "interventions"),
        mean_intervention_m_s2=_mean_over_steps(wrapped, "mean_intervention_m_s2"),
    )


def _rate(flags: Sequence[bool]) -> Rate:
    return Rate(
        count=sum(flags), trials=len(flags), interval=wilson_interval(sum(flags), len(flags))
    )


def _estimate(values: Sequence[float]) -> Estimate:
    interval = bootstrap_interval(values, interquartile_mean) if len(values) > 1 else None
    return Estimate(value=float(interquartile_mean(values)), interval=interval)


def _mean_over_steps(records: Sequence[EpisodeRecord], name: str) -> float | None:
    """Weight episodes by their length, so that every step counts the same."""
    if not records:
        return None
    values = [getattr(record, name) for record in records]
    return float(np.average(values, weights=[record.duration_s for record in records]))
