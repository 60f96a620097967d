"""Time courses of the slow transport, thinned as they are made."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array

WINDOW_S = 60.0
OPENING_S = 10.0

# columns of a sample
POSE, JOINTS, SWING = slice(0, 3), slice(3, 5), slice(5, 6)
POSITION, VELOCITY, FORCE_ERROR = slice(6, 9), slice(9, 12), slice(12, 15)


@dataclass(frozen=True, kw_only=True)
class Course:
    """Samples in windows of 60 s, W of them, and the first S samples one by one.

    A sample is (x, y, θ, q1, q2, φ, grasp position from the goal in world axes, grasp velocity in
    the base frame, Δu_o): 15 columns in m, rad, s.

    Attributes:
        time_s: end of each window, (W,).
        last: the last sample of each window, (W, 15).
        low: smallest value in each window, (W, 15).
        high: largest value in each window, (W, 15).
        power: mean square in each window, (W, 15).
        opening_time_s: (S,).
        opening: (S, 15).
        largest_velocity_m_s: largest |velocity| on each axis of the base frame, (3,), at any sample
            of the force loop: those above are of the slower outer loop.
        largest_swing_rad: likewise max |φ|, (1,).
    """

    time_s: Array
    last: Array
    low: Array
    high: Array
    power: Array
    opening_time_s: Array
    opening: Array
    largest_velocity_m_s: Array
    largest_swing_rad: Array

    @property
    def arrays(self) -> dict[str, Array]:
        """The fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


class CourseRecorder:
    """Collects samples into a course."""

    def __init__(self) -> None:
        self._window: list[Array] = []
        self._rows: list[tuple[float, Array]] = []
        self._opening: list[tuple[float, Array]] = []
        self._end_s = WINDOW_S
        self._largest_velocity, self._largest_swing = np.zeros(3), np.zeros(1)

    def note_extremes(self, velocity_b: Array, swing: Array) -> None:
        """Keep the largest of what the force loop saw, (k, 3) m/s and (k, 1) rad."""
        self._largest_velocity = np.maximum(self._largest_velocity, np.abs(velocity_b).max(axis=0))
        self._largest_swing = np.maximum(self._largest_swing, np.abs(swing).max(axis=0))

    def add(self, time_s: float, sample: Array) -> Array | None:
        """Keep a sample; where it completes a window, return the window, (samples, 15)."""
        if time_s <= OPENING_S:
            self._opening.append((time_s, sample))
        self._window.append(sample)
        return self.close(time_s) if time_s >= self._end_s - 1e-6 else None

    def close(self, time_s: float) -> Array:
        """End the window that is open."""
        window = np.array(self._window)
        extremes = (window[-1], window.min(axis=0), window.max(axis=0), (window**2).mean(axis=0))
        self._rows.append((time_s, np.stack(extremes)))
        self._window, self._end_s = [], self._end_s + WINDOW_S
        return window

    def course(self, time_s: float) -> Course:
        """Return what was collected until now."""
        if self._window:
            self.close(time_s)
        values = np.array([row for _, row in self._rows])
        return Course(
            time_s=np.array([time for time, _ in self._rows]),
            last=values[:, 0],
            low=values[:, 1],
            high=values[:, 2],
            power=values[:, 3],
            opening_time_s=np.array([time for time, _ in self._opening]),
            opening=np.array([sample for _, sample in self._opening]),
            largest_velocity_m_s=self._largest_velocity,
            largest_swing_rad=self._largest_swing,
        )
