"""Quantities of the comparison that are computed from observations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.dynamics.frames import base_to_world

Array = NDArray[np.float64]


def heading_error(observation: Array, layout: ObservationLayout) -> Array:
    """Return θ − θ_goal in (−π, π], (n,) rad."""
    sine_cosine = layout.part(observation, "heading")
    return np.arctan2(sine_cosine[:, 0], sine_cosine[:, 1])


def position_from_goal(observation: Array, layout: ObservationLayout) -> Array:
    """Return the grasp position relative to the goal in axes of the goal's heading, (n, 3) m."""
    offset = layout.part(observation, "goal_offset_b")
    return base_to_world(-offset, heading_error(observation, layout))
