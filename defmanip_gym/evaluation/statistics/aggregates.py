"""One number from many scores: functions of arrays (..., members, scenarios), shaped (...).

The first four are those of R. Agarwal et al., "Deep reinforcement learning at the edge of the
statistical precipice", NeurIPS 2021, whose runs are our members (training seeds) and whose tasks
are our scenarios.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Aggregate = Callable[[Array], Array]

WORST_SHARE = 0.1


def interquartile_mean(values: Array) -> Array:
    """Return the mean of the middle half: robust like the median, with less scatter.

    Episodes without a value (NaN) do not take part; without any the mean is NaN.
    """
    ordered = np.sort(_pooled(values), axis=-1)  # NaN last
    count = np.isfinite(ordered).sum(axis=-1, keepdims=True)
    cut = count // 4
    rank = np.arange(ordered.shape[-1])
    inside = (rank >= cut) & (rank < count - cut)
    total = np.where(inside, ordered, 0.0).sum(axis=-1)
    return _ratio(total, inside.sum(axis=-1))


def mean(values: Array) -> Array:
    """Return the mean over members and scenarios; NaN does not take part."""
    finite = np.isfinite(values)
    return _ratio(np.where(finite, values, 0.0).sum(axis=(-2, -1)), finite.sum(axis=(-2, -1)))


def median(values: Array) -> Array:
    """Return the median over scenarios of the members' mean."""
    return np.asarray(np.median(np.mean(values, axis=-2), axis=-1))


def optimality_gap(values: Array, threshold: float = 1.0) -> Array:
    """Return by how much the scores fall short of a threshold on average; none gains beyond it."""
    return threshold - np.minimum(values, threshold).mean(axis=(-2, -1))


def conditional_value_at_risk(values: Array, worst_share: float = WORST_SHARE) -> Array:
    """Return the mean of the largest ``worst_share`` of the values, CVaR.

    Where that is no whole number of values, the smallest of them counts by the missing fraction,
    which makes it the minimum over c of c + E[max(x − c, 0)] / share: R. T. Rockafellar and
    S. Uryasev, "Optimization of conditional value-at-risk", J. Risk 2 (2000).
    """
    descending = -np.sort(-_pooled(values), axis=-1)
    wanted = worst_share * descending.shape[-1]
    weights = np.clip(wanted - np.arange(descending.shape[-1]), 0.0, 1.0)
    return np.asarray(descending @ weights / wanted)


SCORE_AGGREGATES: Mapping[str, Aggregate] = {
    "iqm": interquartile_mean,
    "mean": mean,
    "median": median,
    "optimality_gap": optimality_gap,
}


def _pooled(values: Array) -> Array:
    return values.reshape(*values.shape[:-2], -1)


def _ratio(total: Array, count: NDArray[np.int64]) -> Array:
    """Divide, with NaN for nothing over nothing."""
    return np.divide(total, count, out=np.full(np.shape(total), np.nan), where=count > 0)
