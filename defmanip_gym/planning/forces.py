"""What forces a plan takes, and of the robot's limits how much: the planner leaves them out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defmanip_gym.planning.model import (
    REACH,
    REACH_RATE,
    SWING,
    SWING_RATE,
    Array,
)
from defmanip_gym.planning.plan import Plan
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import PITCH_TO_JOINT, ArmKinematics


def arm_pitches(setting: PlanningSetting, reach: Array, height: Array) -> Array:
    """Return α (..., 2) rad with the elbow up, for ρ and z over the shoulder, (...) m each."""
    upper, fore = setting.robot.upper_arm.length_m, setting.robot.forearm.length_m
    squared = reach**2 + height**2
    cosine = np.clip((squared - upper**2 - fore**2) / (2 * upper * fore), -1.0, 1.0)
    elbow = -np.arccos(cosine)
    aside = np.arctan2(fore * np.sin(elbow), upper + fore * np.cos(elbow))
    first = np.arctan2(height, reach) - aside
    return np.stack((first, first + elbow), axis=-1)


def force_shares(setting: PlanningSetting, plan: Plan) -> Array:
    """Return |T_r| of Eq. (28) over the robot's limits along a plan, (K, 4).

    Args:
        setting: whose robot and beam; the inner loop believes in no damping at the root.
        plan: made in it.
    """
    robot, states = setting.robot, plan.states[:-1]
    goal_reach, goal_height = setting.goal_reach_and_height_m
    height = states[:, 2] + goal_height - robot.shoulder_height_m
    pitch = arm_pitches(setting, states[:, REACH], height)
    slopes = ArmKinematics(robot).jacobian(pitch)
    moving = np.stack((states[:, REACH_RATE], states[:, 6]), axis=-1)
    pitch_rate = np.linalg.solve(slopes, moving[..., None])[..., 0]
    yaw_rate = states[:, 5] / states[:, REACH]
    base = np.stack((states[:, 4] - states[:, REACH_RATE], yaw_rate), axis=-1)
    loop = FeedbackLinearization(
        robot,
        replace(setting.beam, damping=0.0),
        RedundancyResolution(robot, goal_reach_m=goal_reach),
    )
    forces = loop.generalized_forces(
        plan.commands,
        np.asarray(pitch @ PITCH_TO_JOINT.T, dtype=np.float64),
        np.asarray(pitch_rate @ PITCH_TO_JOINT.T, dtype=np.float64),
        base,
        states[:, SWING : SWING + 1],
        states[:, SWING_RATE:],
    )
    shares: Array = np.abs(forces) / np.array(robot.force_limits)
    return shares
