"""What disturbs n episodes: the same for all, or drawn anew for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import DisturbanceParams
from defmanip_gym.state_tree import fitted

Array = NDArray[np.float64]
Ids = NDArray[np.intp]

_NAMES = tuple(field.name for field in fields(DisturbanceParams))


class EpisodeDisturbances:
    """Forces at the grasp and noises of n episodes.

    Args:
        config: the environment's definition, with the ranges to draw from.
        generators: one for each episode, looked up anew at every draw.
    """

    def __init__(self, config: TransportConfig, generators: Sequence[np.random.Generator]) -> None:
        self._given, self._ranges = config.disturbance, config.disturbance_ranges
        self._period_s = config.task.control_period_s
        self._generators = generators
        self._own = np.array(astuple(config.disturbance))
        self._values = np.tile(self._own, (len(generators), 1))
        self.largest = config.largest_disturbance

    def draw(self, ids: Ids) -> None:
        """Let new episodes, (k,) increasing, have disturbances of their own, or the given one."""
        if self._ranges.is_empty:
            self._values[ids] = self._own
            return
        for index in ids:
            drawn = self._ranges.sample(self._given, self._generators[index])
            self._values[index] = astuple(drawn)

    @property
    def has_force(self) -> bool:
        """Whether a force acts on any of the end effectors."""
        return bool(self._column("force_amplitude_n").any() or self._column("force_bias_n").any())

    def force(self, steps: NDArray[np.int64]) -> Array:
        """Return the forces on the end effectors, (n, 3) N in the base frame.

        Args:
            steps: control periods since the start of each episode, (n,).
        """
        phase = self._column("force_frequency_rad_s") * (steps * self._period_s)
        force = self._column("force_bias_n") + self._column("force_amplitude_n") * np.sin(phase)
        return np.repeat(force[:, None], 3, axis=1)

    def deviations(self, ids: Ids) -> tuple[Array, Array]:
        """Return the noises of force and swing sensors of the episodes ``ids``, (k, 1) each."""
        force_n = self._column("force_sensor_noise_n")[ids, None]
        return force_n, self._column("swing_sensor_noise_rad")[ids, None]

    def get_state(self) -> Array | None:
        """Return the episodes' values, (n, 5), or None where all are the given ones."""
        return self._values.copy() if (self._values != self._own).any() else None

    def fitting(self, state: Any) -> Array:
        """Return the values of a state; those given where it holds none.

        Raises:
            StateError: it is of another number of episodes.
            ParameterError: it holds values that no disturbance has.
        """
        if state is None:
            return np.tile(self._own, (len(self._values), 1))
        rows: Array = fitted("state['disturbances']", state, self._values)
        for row in rows.tolist():
            DisturbanceParams(**dict(zip(_NAMES, row, strict=True)))
        return rows

    def set_state(self, values: Array) -> None:
        """Go on with what ``fitting`` returned."""
        self._values = values

    def _column(self, name: str) -> Array:
        return self._values[:, _NAMES.index(name)]
