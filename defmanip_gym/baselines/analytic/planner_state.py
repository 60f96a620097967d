"""What a sample says of the planner's state."""

from __future__ import annotations

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.planning.model import (
    HEADING,
    POSITION,
    REACH,
    REACH_RATE,
    STATE_SIZE,
    SWING,
    VELOCITY,
    Array,
)


def planner_states(now: GraspSample) -> Array:
    """Return states (n, 11) in the order of ``planning.model.STATE``, of a beam of one segment."""
    states = np.empty((len(now.heading), STATE_SIZE))
    states[:, POSITION], states[:, HEADING] = now.position, now.heading
    states[:, VELOCITY] = now.velocity_b
    states[:, REACH], states[:, REACH_RATE] = now.reach, now.reach_rate
    states[:, SWING:] = np.hstack((now.swing, now.swing_rate))
    return states
