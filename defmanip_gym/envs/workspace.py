"""The region in which the robot can work; leaving it ends an episode."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.robot_model import JOINT_TO_PITCH, ArmKinematics

Array = NDArray[np.float64]


def in_workspace(base_pose: Array, joints: Array, config: TransportConfig) -> NDArray[np.bool_]:
    """Whether the base is in the arena and the arm clear of its singularities, (n,).

    Args:
        base_pose: (n, 3).
        joints: q_a, (n, 2) rad; the elbow must point up, −π < q2 < 0.
        config: limits and geometry.
    """
    task = config.task
    grasp = ArmKinematics(config.robot).reach_and_height(joints @ JOINT_TO_PITCH.T)
    x, y = task.goal[:2]
    arena = np.hypot(base_pose[:, 0] - x, base_pose[:, 1] - y) < task.arena_radius_m
    bend = task.smallest_elbow_bend_rad
    elbow = (joints[:, 1] < -bend) & (joints[:, 1] > bend - math.pi)
    clear = (grasp[:, 0] > task.smallest_reach_m) & (grasp[:, 1] > task.smallest_grasp_height_m)
    return np.asarray(arena & elbow & clear)
