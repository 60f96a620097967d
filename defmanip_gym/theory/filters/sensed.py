"""What filters look at: the motion that observations tell of, n episodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.frames import base_to_world


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
        values = np.asarray(observation, dtype=np.float64)
        sine, cosine = layout.part(values, "heading").T
        return cls(
            velocity_b=layout.part(values, "grasp_velocity_b").copy(),
            base_velocity=layout.part(values, "base_velocity").copy(),
            pitch=layout.part(values, "joints").cumsum(axis=1),
            pitch_rate=layout.part(values, "joint_rates").cumsum(axis=1),
            swing=layout.part(values, "swing").copy(),
            swing_rate=layout.part(values, "swing_rate").copy(),
            heading=np.arctan2(sine, cosine),
        )

    @classmethod
    def empty(cls, count: int, segments: int) -> Sensed:
        """Return n states at rest."""
        shapes = [(count, size) for size in (3, 2, 2, 2, segments, segments)]
        return cls(*(np.zeros(shape) for shape in (*shapes, (count,))))

    def replaced(self, other: Sensed, where: NDArray[np.bool_]) -> Sensed:
        """Return these states with those of ``other`` where (n,) says so."""
        chosen = (
            np.where(where[:, None] if new.ndim == 2 else where, new, old)
            for old, new in zip(self, other, strict=True)
        )
        return Sensed(*chosen)


def gained_acceleration(before: Sensed, after: Sensed, period_s: float) -> Array:
    """Return the mean acceleration of a period, (n, 3) m/s², in the base frame of its middle."""
    turned = after.heading - before.heading
    turned = (turned + np.pi) % (2 * np.pi) - np.pi
    later = base_to_world(after.velocity_b, turned / 2)
    earlier = base_to_world(before.velocity_b, -turned / 2)
    gained: Array = (later - earlier) / period_s
    return gained
