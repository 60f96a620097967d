"""Turning horizontal vectors between the world and the base frame."""

from __future__ import annotations

import numpy as np

from defmanip_gym.theory.chain import Array


def world_to_base(vector_w: Array, heading: Array) -> Array:
    """Return a (..., 3) world vector in the base frame of a robot at ``heading`` (...) rad."""
    return base_to_world(vector_w, -heading)


def base_to_world(vector_b: Array, heading: Array) -> Array:
    """Return a (..., 3) vector of the base frame in world coordinates."""
    cos, sin = np.cos(heading), np.sin(heading)
    x, y = vector_b[..., 0], vector_b[..., 1]
    return np.stack((cos * x - sin * y, sin * x + cos * y, vector_b[..., 2]), axis=-1)
