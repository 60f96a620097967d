"""Where a peak that grows with a factor crosses a level, several factors at a time."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array

ACCURACY = 5e-3
# the peaks of soft objects grow a little less than in proportion
_FIRST_RANGE = (0.99, 1.02)
_MOST_TRIALS = 12


def smallest_crossing(
    peaks: Callable[[Array], Array], level: float, *, guess: float, count: int
) -> float:
    """Return the smallest factor tried whose peak exceeds a level; infinite if none did.

    The one tried below it, less than 0.5 % smaller, does not exceed it.

    Args:
        peaks: maps ``count`` factors to peaks.
        level: the level to cross.
        guess: factor near which to look first.
        count: factors that are tried at once.
    """
    factors, best = guess * np.linspace(*_FIRST_RANGE, count), math.inf
    for _ in range(_MOST_TRIALS):
        reached = peaks(factors)
        above = np.flatnonzero(reached > level)
        if not len(above):
            if math.isfinite(best):
                return best
            # at most doubled: an object may need far less than in proportion
            missing = level / max(float(reached[-1]), 1e-9)
            widest = np.linspace(1.0, max(1.1, min(2.0, 1.1 * missing)), count + 1)[1:]
            factors = factors[-1] * widest
            continue
        best = float(factors[above[0]])
        if above[0] == 0:
            factors = best * np.linspace(0.8, 1.0, count)
            continue
        below = factors[above[0] - 1]
        if best - below < ACCURACY * best:
            return best
        factors = np.linspace(below, best, count)
    return best
