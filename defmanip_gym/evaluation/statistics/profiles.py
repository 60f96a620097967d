"""Performance profiles: which share of the episodes scores above any threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.evaluation.statistics.aggregates import Array
from defmanip_gym.evaluation.statistics.intervals import CONFIDENCE
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap, Sample


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A score distribution with its pointwise band.

    Attributes:
        thresholds: τ, (T,).
        shares: P(score > τ), (T,).
        low: (T,) lower end of the band.
        high: (T,) upper end.
    """

    thresholds: Array
    shares: Array
    low: Array
    high: Array


def score_distribution(values: Array, thresholds: Array) -> Array:
    """Return P(score > τ), (..., T), of scores (..., members, scenarios).

    E. D. Dolan and J. J. Moré, "Benchmarking optimization software with performance profiles",
    Math. Program. 91 (2002); over scores as in Agarwal et al. 2021.

    Args:
        values: scores.
        thresholds: τ in ascending order, (T,).
    """
    leading, episodes = values.shape[:-2], values.shape[-2] * values.shape[-1]
    count = len(thresholds)
    passed = np.searchsorted(thresholds, values.reshape(-1, episodes))  # τ below each score
    rows = np.arange(len(passed))[:, None] * (count + 1)
    histogram = np.bincount((rows + passed).ravel(), minlength=len(passed) * (count + 1))
    above = histogram.reshape(-1, count + 1)[:, :0:-1].cumsum(axis=1)[:, ::-1]
    return above.reshape(*leading, count) / episodes


def performance_profile(
    bootstrap: CrossedBootstrap,
    sample: Sample,
    thresholds: Array,
    confidence: float = CONFIDENCE,
) -> Profile:
    """Return a contestant's profile with its band from resampled members and scenarios."""
    draws = bootstrap.draws(lambda values: score_distribution(values, thresholds), sample)
    low, high = np.quantile(draws, ((1 - confidence) / 2, (1 + confidence) / 2), axis=0)
    return Profile(
        thresholds=thresholds,
        shares=score_distribution(sample.values, thresholds),
        low=low,
        high=high,
    )
