"""Ranges from which every episode draws what disturbs it."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields

import numpy as np

from defmanip_gym.params import DisturbanceParams
from defmanip_gym.validation import require_range, settle

_FORCE_N = 1e4
_MOST = 1e9  # of frequencies and noises


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
