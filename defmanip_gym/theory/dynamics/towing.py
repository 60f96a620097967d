"""How the base turns while its grasp moves: as a trailer does, towed or pushed from ρ ahead."""

from __future__ import annotations

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array


def towed_heading(heading: Array, velocity: Array, reach: Array, seconds: float) -> Array:
    """Return the heading of a base whose grasp has moved at a constant velocity, (n,) rad.

    tan of half the angle between heading and velocity fades as exp(−|v| t / ρ).

    Args:
        heading: before, (n,) rad.
        velocity: (n, 2) m/s, in axes that do not turn.
        reach: ρ, (n,) m.
        seconds: how long.
    """
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    course = np.arctan2(velocity[:, 1], velocity[:, 0])
    half = 0.5 * (heading - course)
    faded = np.arctan2(np.exp(-speed * seconds / reach) * np.sin(half), np.cos(half))
    turned: Array = course + 2.0 * faded
    return turned
