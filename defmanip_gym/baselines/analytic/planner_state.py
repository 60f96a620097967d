"""What observations say of the planner's state."""

from __future__ import annotations

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import grasp_sample
from defmanip_gym.observation import ObservationLayout
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
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics


def planner_states(
    observation: Array, layout: ObservationLayout, kinematics: ArmKinematics
) -> Array:
    """Return states (n, 11) in the order of ``planning.model.STATE``.

    Args:
        observation: (n, size), of a beam of one segment.
        layout: of the beam carried.
        kinematics: of the arm that carries it.
    """
    now = grasp_sample(observation, layout, kinematics)
    pitch = layout.part(observation, "joints") @ JOINT_TO_PITCH.T
    pitch_rate = layout.part(observation, "joint_rates") @ JOINT_TO_PITCH.T
    states = np.empty((len(observation), STATE_SIZE))
    states[:, POSITION], states[:, HEADING] = now.position, now.heading
    states[:, VELOCITY], states[:, REACH] = now.velocity_b, now.reach
    states[:, REACH_RATE] = (kinematics.jacobian(pitch)[:, 0] * pitch_rate).sum(axis=1)
    states[:, SWING:] = np.hstack((now.swing, now.swing_rate))
    return states
