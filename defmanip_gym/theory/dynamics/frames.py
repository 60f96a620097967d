"""Angles, and horizontal vectors turned between the world and the base frame."""

from __future__ import annotations

import math

import numpy as np

from defmanip_gym.compiled import Numbers, compilable
from defmanip_gym.theory.dynamics.chain import Array


def world_to_base(vector_w: Array, heading: Array) -> Array:
    """Return a (..., 3) world vector in the base frame of a robot at ``heading`` (...) rad."""
    return base_to_world(vector_w, -heading)


def base_to_world(vector_b: Array, heading: Array) -> Array:
    """Return a (..., 3) vector of the base frame in world coordinates."""
    x, y = turned(vector_b[..., 0], vector_b[..., 1], heading)
    return np.stack((x, y, vector_b[..., 2]), axis=-1)


@compilable
def wrapped(angle: float) -> float:
    """Return the angle in (−π, π]."""
    return angle - 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi))


@compilable
def turned(x: Numbers, y: Numbers, angle: Numbers) -> tuple[Numbers, Numbers]:
    """Return the components (...) of a plane vector turned by ``angle`` (...) rad."""
    cos, sin = np.cos(angle), np.sin(angle)
    return cos * x - sin * y, sin * x + cos * y
