"""What filters look at: the motion that observations tell of, n episodes."""

from __future__ import annotations

from math import atan2, cos, floor, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.errors import ParameterError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.dynamics.chain import Array

_SLICES = ObservationLayout(1).slices  # the first ones do not depend on the segments
_HEADING = _SLICES["heading"].start
_VELOCITY = _SLICES["grasp_velocity_b"].start
_BASE = _SLICES["base_velocity"].start
_JOINTS = _SLICES["joints"].start
_RATES = _SLICES["joint_rates"].start
_SWING = _SLICES["swing"].start


class Sensed(NamedTuple):
    """The state of n episodes (compiled code takes named tuples).

    Attributes:
        velocity_b: of the grasp, (n, 3) m/s, base frame.
        base_velocity: (u1, u2), (n, 2) m/s, rad/s.
        pitch: α of the arm, (n, 2) rad.
        pitch_rate: α̇, (n, 2) rad/s.
        swing: φ, (n, N) rad.
        swing_rate: φ̇, (n, N) rad/s.
        heading: θ − θ_goal, (n,) rad.
    """

    velocity_b: Array
    base_velocity: Array
    pitch: Array
    pitch_rate: Array
    swing: Array
    swing_rate: Array
    heading: Array

    @classmethod
    def observed(cls, layout: ObservationLayout, observation: Array) -> Sensed:
        """Return the state that observations (n, size) tell of, as copies.

        Raises:
            ParameterError: observations of another size.
        """
        if np.ndim(observation) != 2 or np.shape(observation)[1] != layout.size:
            raise ParameterError(
                "observation shape",
                np.shape(observation),
                f"(n, {layout.size}), of {layout.segment_count} segments",
                "Filter the environment that the filter was made for.",
            )
        values = np.ascontiguousarray(observation, dtype=np.float64)
        sensed = cls._room(len(values), layout.segment_count)
        _read_all(values, layout.segment_count, sensed)
        return sensed

    @classmethod
    def empty(cls, count: int, segments: int) -> Sensed:
        """Return n states at rest."""
        sensed = cls._room(count, segments)
        for part in sensed:
            part[:] = 0.0
        return sensed

    @classmethod
    def _room(cls, count: int, segments: int) -> Sensed:
        shapes = [(count, size) for size in (3, 2, 2, 2, segments, segments)]
        return cls(*(np.empty(shape) for shape in (*shapes, (count,))))

    def replaced(self, other: Sensed, where: NDArray[np.bool_]) -> Sensed:
        """Return these states with those of ``other`` where (n,) says so."""
        chosen = (
            np.where(where[:, None] if new.ndim == 2 else where, new, old)
            for old, new in zip(self, other, strict=True)
        )
        return Sensed(*chosen)


@compilable
def gained_acceleration(
    before: Sensed, after: Sensed, i: int, period_s: float
) -> tuple[float, float, float]:
    """Return the mean acceleration of a period, m/s², in the base frame of its middle."""
    turned = after.heading[i] - before.heading[i]
    turned -= 2.0 * pi * floor((turned + pi) / (2.0 * pi))
    cosine, sine = cos(0.5 * turned), sin(0.5 * turned)
    then, now = before.velocity_b, after.velocity_b
    forward = cosine * now[i, 0] - sine * now[i, 1] - (cosine * then[i, 0] + sine * then[i, 1])
    left = sine * now[i, 0] + cosine * now[i, 1] - (cosine * then[i, 1] - sine * then[i, 0])
    return forward / period_s, left / period_s, (now[i, 2] - then[i, 2]) / period_s


@compiled
def _read_all(observation: Array, segments: int, sensed: Sensed) -> None:
    """Take n states out of observations (n, size), whose order is ``ObservationLayout``'s."""
    for i in range(len(observation)):
        row = observation[i]
        sensed.heading[i] = atan2(row[_HEADING], row[_HEADING + 1])
        for k in range(3):
            sensed.velocity_b[i, k] = row[_VELOCITY + k]
        for k in range(2):
            sensed.base_velocity[i, k] = row[_BASE + k]
        sensed.pitch[i, 0] = row[_JOINTS]
        sensed.pitch[i, 1] = row[_JOINTS] + row[_JOINTS + 1]
        sensed.pitch_rate[i, 0] = row[_RATES]
        sensed.pitch_rate[i, 1] = row[_RATES] + row[_RATES + 1]
        for j in range(segments):
            sensed.swing[i, j] = row[_SWING + j]
            sensed.swing_rate[i, j] = row[_SWING + segments + j]
