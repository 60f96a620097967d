"""A point that a grasp can follow: it moves along a velocity field within limits on acceleration.

A field (Section IV.A) says how fast to move where, but not how to get that fast. The point starts
at rest with the grasp and is a double integrator that takes up the field's velocity as quickly as
its limits allow. Axes are the field's: the goal at the origin, x along the goal's heading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.theory.control.velocity_field import VelocityField
from defmanip_gym.theory.dynamics.chain import Array

_TINY = 1e-12


@dataclass(frozen=True, kw_only=True)
class MovingReference:
    """Where the point is in one sample.

    Attributes:
        position: (n, 3) m.
        velocity: (n, 3) m/s.
        acceleration: until the next sample, (n, 3) m/s².
    """

    position: Array
    velocity: Array
    acceleration: Array

    @staticmethod
    def at(position: Array, velocity: Array) -> MovingReference:
        """Return points with a motion (n, 3) each that nothing accelerates yet."""
        return MovingReference(
            position=position, velocity=velocity, acceleration=np.zeros_like(position)
        )

    def moved(self, period_s: float) -> MovingReference:
        """Return the points one sample later, before they choose another acceleration."""
        change = period_s * self.acceleration
        position = self.position + period_s * (self.velocity + 0.5 * change)
        return MovingReference(
            position=position, velocity=self.velocity + change, acceleration=self.acceleration
        )

    def steered(self, field: VelocityField, limit: float, period_s: float) -> MovingReference:
        """Return the points with the acceleration that takes up the field's velocity.

        Args:
            field: ż_1d at each position.
            limit: largest acceleration in the plane, and likewise in height, m/s².
            period_s: sampling period.
        """
        ahead = self.position + period_s * self.velocity
        wanted = (field.velocity(ahead) - self.velocity) / period_s
        planar = _shortened(wanted[:, :2], limit)
        vertical = np.clip(wanted[:, 2:], -limit, limit)
        return MovingReference(
            position=self.position,
            velocity=self.velocity,
            acceleration=np.concatenate((planar, vertical), axis=1),
        )


def streamline(
    field: VelocityField, position: Array, times_s: Array, step_s: float
) -> tuple[Array, Array]:
    """Return where a field takes positions until each time, and its velocity there, (n, k, 3) each.

    Args:
        field: ż_1d at each position.
        position: (n, 3) m.
        times_s: (k,), rising.
        step_s: longest of the integration's steps (midpoint rule).
    """
    positions, velocities = [], []
    velocity = field.velocity(position)
    for seconds in np.diff(times_s, prepend=0.0):
        steps = max(1, round(seconds / step_s))
        step = seconds / steps
        for _ in range(steps):
            position = position + step * field.velocity(position + 0.5 * step * velocity)
            velocity = field.velocity(position)
        positions.append(position)
        velocities.append(velocity)
    return np.stack(positions, axis=1), np.stack(velocities, axis=1)


def _shortened(vectors: Array, longest: float) -> Array:
    """Return vectors (n, 2) no longer than that, in their directions."""
    length = np.hypot(vectors[:, 0], vectors[:, 1])
    shortened: Array = vectors * np.minimum(1.0, longest / np.maximum(length, _TINY))[:, None]
    return shortened
