"""First-order models of smooth functions, so that a fast loop need not evaluate them anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array

_STEP = 1e-4


@dataclass(frozen=True, kw_only=True)
class LocalModel:
    """f(x) ≈ offset + x · slope."""

    offset: Array
    slope: Array

    def __call__(self, x: Array) -> Array:
        """Return the model at x, (n, k) → (n, m)."""
        return self.offset + x @ self.slope


def local_model(function: Callable[[Array], Array], at: Array) -> LocalModel:
    """Return the first-order model of a function about a point, by central differences.

    Args:
        function: (n, k) → (n, m), row by row; called once.
        at: the point, (k,).
    """
    size = len(at)
    shifts = _STEP * np.eye(size)
    values = function(np.concatenate((at[None], at + shifts, at - shifts)))
    slope = (values[1 : 1 + size] - values[1 + size :]) / (2 * _STEP)
    return LocalModel(offset=values[0] - at @ slope, slope=slope)
