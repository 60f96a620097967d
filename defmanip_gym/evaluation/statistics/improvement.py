"""How likely one contestant does better than another on the same scenario."""

from __future__ import annotations

import numpy as np

from defmanip_gym.evaluation.statistics.aggregates import Array


def probability_of_improvement(first: Array, second: Array) -> Array:
    """Return P(first > second) averaged over scenarios, ties counting one half.

    On each scenario it is the Mann-Whitney statistic over the product of the numbers of members
    (Agarwal et al. 2021, Section 4.3).

    Args:
        first: (..., M, S) scores.
        second: (..., M', S) scores on the same scenarios.
    """
    ours, theirs = first[..., :, None, :], second[..., None, :, :]
    wins = (ours > theirs).mean(axis=(-3, -2, -1))
    ties = (ours == theirs).mean(axis=(-3, -2, -1))
    return np.asarray(wins + 0.5 * ties)
