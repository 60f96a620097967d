"""Ranges from which every episode draws what disturbs it."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields, replace

import numpy as np

from defmanip_gym.params import DisturbanceParams
from defmanip_gym.validation import require_range, settle

_FORCE_N = 1e4
_MOST = 1e6  # of frequencies and noises, as DisturbanceParams has it
_BESIDE = 0.999  # of a frequency whose samples would all be zero


@dataclass(frozen=True, kw_only=True)
class DisturbanceRanges:
    """Ranges (low, high), ends included, from which every episode draws its disturbance uniformly.

    Each replaces the value of that name in ``DisturbanceParams``; None keeps it.
    """

    force_amplitude_n: tuple[float, float] | None = None
    force_frequency_rad_s: tuple[float, float] | None = None
    force_bias_n: tuple[float, float] | None = None
    force_sensor_noise_n: tuple[float, float] | None = None
    swing_sensor_noise_rad: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name, low, high, unit in (
            ("force_amplitude_n", -_FORCE_N, _FORCE_N, "N"),
            ("force_frequency_rad_s", 0.0, _MOST, "rad/s"),
            ("force_bias_n", -_FORCE_N, _FORCE_N, "N"),
            ("force_sensor_noise_n", 0.0, _MOST, "N"),
            ("swing_sensor_noise_rad", 0.0, _MOST, "rad"),
        ):
            if getattr(self, name) is not None:
                settle(self, name, require_range, low, high, unit)

    @property
    def is_empty(self) -> bool:
        """Whether every episode keeps all values."""
        return all(ends is None for ends in astuple(self))

    def largest(self, disturbance: DisturbanceParams) -> DisturbanceParams:
        """Return the disturbance with the end of each range that is farther from zero."""
        return DisturbanceParams(
            **{
                name: getattr(disturbance, name) if ends is None else max(ends, key=abs)
                for name, ends in self._ends
            }
        )

    def worst(
        self, disturbance: DisturbanceParams, period_s: float
    ) -> tuple[DisturbanceParams, ...]:
        """Return those of which one is the worst for what foresees a control period, s.

        That are the largest values, but with the frequency that changes the force most from period
        to period, and the bias at either end: it may add to an error of its own, or take from it.
        """
        ends = self.force_frequency_rad_s
        frequency = disturbance.force_frequency_rad_s if ends is None else _wildest(ends, period_s)
        largest = replace(self.largest(disturbance), force_frequency_rad_s=frequency)
        biases = self.force_bias_n or (disturbance.force_bias_n,)
        return tuple(replace(largest, force_bias_n=bias) for bias in dict.fromkeys(biases))

    def sample(
        self, disturbance: DisturbanceParams, generator: np.random.Generator
    ) -> DisturbanceParams:
        """Return the disturbance with new values for those that have a range, drawn in order."""
        return DisturbanceParams(
            **{
                name: getattr(disturbance, name)
                if ends is None
                else float(generator.uniform(*ends))
                for name, ends in self._ends
            }
        )

    @property
    def _ends(self) -> list[tuple[str, tuple[float, float] | None]]:
        return [(field.name, getattr(self, field.name)) for field in fields(self)]


def _wildest(ends: tuple[float, float], period_s: float) -> float:
    """Return the frequency between two at which samples of a sine differ most from the last."""
    low, high = ends
    turning = math.pi / period_s  # at its odd multiples samples change their signs
    odd = 2 * math.ceil(0.5 * (low / turning - 1)) + 1
    if odd * turning <= high:
        return odd * turning * _BESIDE
    return min(ends, key=lambda frequency: abs(frequency / turning % 2 - 1))
