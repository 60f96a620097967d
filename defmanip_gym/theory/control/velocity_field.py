"""Velocity field of Section IV.A from the dipolar potential of Section VI.

Positions p are (..., 3) in m: p_x, p_y relative to the goal of the grasp, p_z − goal height; world
axes. With p_x² (not the printed p_z²) under the root, streamlines reach the goal along ±x.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from defmanip_gym.compiled import Numbers, compilable
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_positive, settle

_TINY = 1e-12


def potential(p: Array) -> Array:
    """Return φ(x_a) = s / √(s² + p_x²) + p_z², s = p_x² + p_y² (Section VI), shape (...)."""
    s = p[..., 0] ** 2 + p[..., 1] ** 2
    return s / np.sqrt(s**2 + p[..., 0] ** 2 + _TINY**2) + p[..., 2] ** 2


def potential_gradient(p: Array) -> Array:
    """Return ∇φ, shape (..., 3); zero at the goal, where φ has a kink."""
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    s = x**2 + y**2
    root = np.sqrt(s**2 + x**2 + _TINY**2)
    return np.stack((x * (x**2 - y**2) / root**3, 2 * y * x**2 / root**3, 2 * z), axis=-1)


def dipole_direction(p: Array) -> Array:
    """Return the unit planar direction of −∇φ, shape (..., 2); towards +x where it vanishes."""
    x, y = p[..., 0], p[..., 1]
    s = x**2 + y**2
    ahead = np.where(x > 0, -1.0, 1.0)
    safe = np.where(s > _TINY, s, 1.0)
    direction = ahead[..., None] * np.stack((x**2 - y**2, 2 * x * y), axis=-1) / safe[..., None]
    return np.where((s > _TINY)[..., None], direction, np.stack((ahead, np.zeros_like(x)), axis=-1))


@compilable
def streamline_heading(x: Numbers, y: Numbers) -> Numbers:
    """Return the heading 2 atan2(p_y, p_x) of a robot driving along the dipole at p, (...) rad.

    Forwards behind the goal (p_x < 0), backwards ahead of it; in (−2π, 2π], without the jump by π
    that the direction of motion makes at p_x = 0.
    """
    return 2 * np.arctan2(y, x)


class VelocityField(Protocol):
    """Desired grasp velocity at each grasp position."""

    def velocity(self, p: Array, heading: Array | None = None) -> Array:
        """Return ż_1d in world axes, (..., 3) m/s, at ``p`` (..., 3) m from the goal.

        Args:
            p: grasp positions.
            heading: θ − θ_goal of the robot, (...) rad, for fields that look at it.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class LiteralField:
    """ż_1d = −k ∇φ, exactly as in Section IV.A.

    The planar gradient fades as 1/r³ with the distance, so a robot far away hardly moves.
    """

    k: float = 1.0

    def __post_init__(self) -> None:
        settle(self, "k", require_positive)

    def velocity(self, p: Array, heading: Array | None = None) -> Array:
        """Return −k ∇φ(p)."""
        return -self.k * potential_gradient(p)


@dataclass(frozen=True, kw_only=True)
class NormalizedField:
    """The dipole's streamlines, travelled at a speed that leaves room to stop.

    Speed at distance r: the smallest of ``max_speed_m_s``, √(2 · deceleration · r) and
    ``approach_rate_per_s`` · r; likewise for the height on its own.
    """

    max_speed_m_s: float
    deceleration_m_s2: float
    vertical_deceleration_m_s2: float
    approach_rate_per_s: float = 0.8

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            settle(self, name, require_positive)

    def velocity(self, p: Array, heading: Array | None = None) -> Array:
        """Return the field at p, whatever the heading."""
        distance = np.hypot(p[..., 0], p[..., 1])
        planar = self._speed(distance, self.deceleration_m_s2)[..., None] * dipole_direction(p)
        height = p[..., 2]
        vertical = -np.sign(height) * self._speed(np.abs(height), self.vertical_deceleration_m_s2)
        return np.concatenate((planar, vertical[..., None]), axis=-1)

    def _speed(self, distance: Array, deceleration: float) -> Array:
        braking = np.sqrt(2 * deceleration * distance)
        approach = self.approach_rate_per_s * distance
        return np.minimum(self.max_speed_m_s, np.minimum(braking, approach))
