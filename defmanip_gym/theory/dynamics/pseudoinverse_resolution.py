"""What Section IV.B avoids: redundancy resolution by the dynamic pseudoinverse.

u̇ = J̄_A (w − J̇_A u) takes, among all accelerations that give the grasp w, the one with the least
u̇ᵀ M_r u̇. It leaves a self-motion to itself: whatever speed it has it keeps, until the arm is
stretched or folded ([15], [16], [20]). Kept as the contrast in tests; ``accelerations`` has the
signature of ``RedundancyResolution``.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.params import RobotParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.theory.dynamics.task_space import task_space_dynamics


class PseudoinverseResolution:
    """Turns a task-space acceleration into accelerations of least inertia-weighted norm.

    Args:
        robot: its inertia weighs the accelerations.
    """

    def __init__(self, robot: RobotParams) -> None:
        self.robot, self.kinematics = robot, ArmKinematics(robot)

    def accelerations(
        self, w: Array, pitch: Array, pitch_rate: Array, base_velocity: Array
    ) -> Array:
        """Return (u̇1, u̇2, α̈1, α̈2), shape (..., 4), that give the grasp the acceleration w.

        Args:
            w: (..., 3) m/s², base frame.
            pitch: α of the arm, (..., 2) rad, away from a straight or folded elbow.
            pitch_rate: α̇, (..., 2) rad/s.
            base_velocity: (u1, u2), (..., 2).
        """
        dynamics = task_space_dynamics(self.robot, pitch, pitch_rate, base_velocity)
        missing = w - self.kinematics.task_bias_acceleration(pitch, pitch_rate, base_velocity)
        accelerations = np.einsum("...ij,...j->...i", dynamics.pseudoinverse, missing)
        accelerations[..., 2:] = accelerations[..., 2:] @ JOINT_TO_PITCH.T
        return accelerations
