"""Swing angles from noisy sensors: averages that the exactly measured rates carry along."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.theory.dynamics.chain import Array

# a Gaussian leaves six standard deviations once in 5e8 draws
NOISE_BOUND = 6.0
_MEMORY = 50  # periods; a longer one gains less than the errors of carrying along cost
# of the noise's standard deviation: the bound on a running average's error
STEADY_SHARE = NOISE_BOUND / (2 * _MEMORY - 1) ** 0.5


class SwingEstimate:
    """Running averages of the swing of n episodes, and how far they may be from the truth.

    Args:
        count: n.
        segments: N.
        noise_rad: standard deviation of a measured angle.
        drift_rad: largest error of carrying an angle along over a period.
        period_s: between samples.
    """

    remembers = ("mean", "variance", "bias", "rate", "age")

    def __init__(
        self, count: int, segments: int, *, noise_rad: float, drift_rad: float, period_s: float
    ) -> None:
        self._noise, self._drift, self._period = noise_rad, drift_rad, period_s
        self.mean = np.zeros((count, segments))
        self.rate = np.zeros((count, segments))
        self.variance, self.bias, self.age = (np.zeros(count) for _ in range(3))

    def begin(self, swing: Array, rate: Array, started: NDArray[np.bool_]) -> None:
        """Let episodes start, (n,), with their first measurements, (n, N)."""
        self.mean[started], self.rate[started] = swing[started], rate[started]
        self.variance[started], self.bias[started] = self._noise**2, 0.0
        self.age[started] = 1.0

    def update(self, swing: Array, rate: Array) -> None:
        """Take measurements of a period later, (n, N)."""
        self.age = np.minimum(self.age + 1.0, _MEMORY)
        gain = 1.0 / self.age
        carried = self.mean + 0.5 * self._period * (self.rate + rate)
        self.mean = carried + gain[:, None] * (swing - carried)
        self.variance = (1 - gain) ** 2 * self.variance + (gain * self._noise) ** 2
        self.bias = (1 - gain) * (self.bias + self._drift)
        self.rate = rate.copy()

    @property
    def uncertainty(self) -> Array:
        """How far an angle may be from its estimate, (n, N) rad."""
        bound = NOISE_BOUND * np.sqrt(self.variance) + self.bias
        return np.repeat(bound[:, None], self.mean.shape[1], axis=1)
