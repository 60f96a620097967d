"""Noise of the force and swing sensors, from each episode's own generator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import DisturbanceParams

Array = NDArray[np.float64]
Ids = NDArray[np.intp]

# A draw costs microseconds however long it is, so each episode draws for many steps at once.
_STEPS_PER_DRAW = 64


class SensorNoise:
    """Adds noise to the observations of n episodes.

    Args:
        disturbance: its standard deviations.
        layout: of the observations.
        generators: one for each episode; read anew at every draw.
    """

    def __init__(
        self,
        disturbance: DisturbanceParams,
        layout: ObservationLayout,
        generators: Sequence[np.random.Generator],
    ) -> None:
        deviations = np.zeros(layout.size)
        layout.part(deviations, "grasp_force_b")[:] = disturbance.force_sensor_noise_n
        layout.part(deviations, "swing")[:] = disturbance.swing_sensor_noise_rad
        self._columns = np.flatnonzero(deviations)
        self._deviations = deviations[self._columns]
        self._generators = generators
        count = len(generators)
        self._drawn = np.empty((count, _STEPS_PER_DRAW, len(self._columns)))
        self._used = np.full(count, _STEPS_PER_DRAW)

    def restart(self, ids: Ids) -> None:
        """Forget what was drawn for the episodes that end."""
        self._used[ids] = _STEPS_PER_DRAW

    def add(self, observations: Array, ids: Ids) -> None:
        """Add one step's noise to the rows ``ids`` of observations (n, size), in place."""
        if not self._columns.size:
            return
        for index in ids[self._used[ids] == _STEPS_PER_DRAW]:
            drawn = self._drawn[index]
            drawn[:] = self._generators[index].standard_normal(drawn.shape)
            self._used[index] = 0
        noise = self._drawn[ids, self._used[ids]] * self._deviations
        observations[ids[:, None], self._columns] += noise
        self._used[ids] += 1
