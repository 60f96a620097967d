"""Noise of the force and swing sensors, from each episode's own generator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.disturbance import EpisodeDisturbances
from defmanip_gym.errors import StateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.state_tree import fitted, require_drawn

Array = NDArray[np.float64]
Ids = NDArray[np.intp]

# A draw costs microseconds however long it is, so each episode draws for many steps at once.
_STEPS_PER_DRAW = 64


class SensorNoise:
    """Adds noise to the observations of n episodes.

    Args:
        disturbances: of the episodes, with their standard deviations.
        layout: of the observations.
        generators: one for each episode; read anew at every draw.
    """

    def __init__(
        self,
        disturbances: EpisodeDisturbances,
        layout: ObservationLayout,
        generators: Sequence[np.random.Generator],
    ) -> None:
        largest, noisy, feeling = disturbances.largest, np.zeros(layout.size), np.zeros(layout.size)
        layout.part(feeling, "grasp_force_b")[:] = largest.force_sensor_noise_n
        layout.part(noisy, "swing")[:] = largest.swing_sensor_noise_rad
        self._columns = np.flatnonzero(feeling + noisy)
        self._feels = feeling[self._columns] > 0
        self._disturbances = disturbances
        self._generators = generators
        count = len(generators)
        self._drawn = np.zeros((count, _STEPS_PER_DRAW, len(self._columns)))
        self._used = np.full(count, _STEPS_PER_DRAW)

    def restart(self, ids: Ids) -> None:
        """Forget what was drawn for the episodes that end."""
        self._used[ids] = _STEPS_PER_DRAW

    def get_state(self) -> dict[str, Any]:
        """Return what has been drawn, and how much of it is used."""
        return {"drawn": self._drawn.copy(), "used": self._used.copy()}

    def fitting(self, state: Any) -> dict[str, Any]:
        """Return a state for ``set_state``: what is given, or nothing drawn if sensors differ.

        Raises:
            StateError: it is of another number of episodes.
        """
        own = self.get_state()
        try:
            sensors = np.shape(state["drawn"])[1:]
        except (TypeError, LookupError) as error:
            raise StateError("state['noise']", state, "a dict", "See get_state.") from error
        if sensors != own["drawn"].shape[1:]:
            own["used"][:] = _STEPS_PER_DRAW
            return own
        fit: dict[str, Any] = fitted("state['noise']", state, own)
        require_drawn("state['noise']['used']", fit["used"], _STEPS_PER_DRAW)
        return fit

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned."""
        self._drawn[:], self._used[:] = state["drawn"], state["used"]

    def add(self, observations: Array, ids: Ids) -> None:
        """Add one step's noise to the rows ``ids`` of observations (n, size), in place."""
        if not self._columns.size:
            return
        for index in ids[self._used[ids] == _STEPS_PER_DRAW]:
            drawn = self._drawn[index]
            drawn[:] = self._generators[index].standard_normal(drawn.shape)
            self._used[index] = 0
        deviations = np.where(self._feels, *self._disturbances.deviations(ids))
        noise = self._drawn[ids, self._used[ids]] * deviations
        observations[ids[:, None], self._columns] += noise
        self._used[ids] += 1
