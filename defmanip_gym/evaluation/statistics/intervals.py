"""Numbers with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import require_between, require_whole

Array = NDArray[np.float64]
Interval = tuple[float, float]

CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A number with its interval; None where nothing can be resampled."""

    value: float
    interval: Interval | None

    @property
    def is_positive(self) -> bool:
        """Whether the whole interval lies above zero."""
        return self.interval is not None and self.interval[0] > 0

    @property
    def is_negative(self) -> bool:
        """Whether the whole interval lies below zero."""
        return self.interval is not None and self.interval[1] < 0


@dataclass(frozen=True, kw_only=True)
class Rate:
    """How many of the trials, with an interval of the share."""

    count: int
    trials: int
    interval: Interval

    @property
    def share(self) -> float:
        """The rate itself."""
        return self.count / self.trials


def wilson_interval(successes: int, trials: int, confidence: float = CONFIDENCE) -> Interval:
    """Return the score interval of a rate; honest at 0 % and 100 %, unlike the normal one.

    It takes the trials for independent. Episodes of one member are, given that its scenarios were
    drawn so; those of several members on the same scenarios are not (see ``summary``).

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference",
    J. Am. Stat. Assoc. 22 (1927).

    Raises:
        ParameterError: no trials, or successes not among them.
    """
    trials = require_whole("trials", trials, 1)
    successes = require_whole("successes", successes, 0)
    confidence = require_between("confidence", confidence, 0.0, 1.0)
    if successes > trials:
        raise ParameterError("successes", successes, f"at most {trials} trials", "Count again.")
    interval = stats.binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    return float(interval.low), float(interval.high)


@dataclass(frozen=True)
class VarianceComponent:
    """One source of an estimate's variance, and the degrees of freedom of its own estimate."""

    variance: float
    degrees_of_freedom: float


def welch_interval(
    value: float, components: Sequence[VarianceComponent], confidence: float = CONFIDENCE
) -> Interval | None:
    """Return Student's interval of an estimate whose variance is a sum of estimated ones.

    B. L. Welch, "The generalization of Student's problem when several different population
    variances are involved", Biometrika 34 (1947). Without components there is no interval.
    """
    confidence = require_between("confidence", confidence, 0.0, 1.0)
    if not components:
        return None
    variance = sum(part.variance for part in components)
    if variance == 0.0:
        return value, value
    squares = sum(part.variance**2 / part.degrees_of_freedom for part in components)
    half_width = stats.t.ppf((1.0 + confidence) / 2.0, variance**2 / squares) * variance**0.5
    return float(value - half_width), float(value + half_width)


def percentile_interval(draws: Array, confidence: float = CONFIDENCE) -> Interval | None:
    """Return the percentile interval of bootstrap draws, (R,).

    Resamples without a value (NaN), as of times where nobody arrived, do not count; without any
    value there is no interval.
    """
    confidence = require_between("confidence", confidence, 0.0, 1.0)
    finite = draws[np.isfinite(draws)]
    if not finite.size:
        return None
    low, high = np.quantile(finite, ((1.0 - confidence) / 2.0, (1.0 + confidence) / 2.0))
    return float(low), float(high)
