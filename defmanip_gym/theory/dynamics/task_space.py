"""Task-space dynamics of the robot, Eqs. (3), (4), and of robot and object together, (8), (28).

Vectors are in the base frame and accelerations inertial, so J̇_A u holds what turning the frame
adds. The print has 𝓜̇ J_A u in 𝒞 where solving Eq. (2) for ẍ_a leaves 𝓜 J̇_A u
(docs/derivations.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import ArmKinematics, robot_dynamics
from defmanip_gym.theory.payload.object_model import HangingBeam


@dataclass(frozen=True, kw_only=True)
class TaskSpaceDynamics:
    """The terms of 𝓜 ẍ_a + 𝒞 = 𝒯 − F, Eq. (3), at one state.

    Attributes:
        inertia: 𝓜, (..., 3, 3) kg.
        bias: 𝒞, (..., 3) N.
        pseudoinverse: J̄_A, (..., 4, 3), the dynamically consistent inverse of J_A.
    """

    inertia: Array
    bias: Array
    pseudoinverse: Array

    def task_force(self, generalized_forces: Array) -> Array:
        """Return 𝒯 = J̄_Aᵀ T_r of Eq. (4), (..., 3) N, from T_r (..., 4) in N and N·m."""
        return np.einsum("...ji,...j->...i", self.pseudoinverse, generalized_forces)


@dataclass(frozen=True, kw_only=True)
class CombinedTaskDynamics:
    """The terms of [𝓜 + m̃_o11] ẍ_a + N = 𝒯, Eq. (8), at one state.

    Attributes:
        inertia: 𝓜 + m̃_o11, (..., 3, 3) kg.
        bias: N, (..., 3) N.
    """

    inertia: Array
    bias: Array

    def linearizing_task_force(self, w: Array) -> Array:
        """Return 𝒯 = [𝓜 + m̃_o11] w + N, Eq. (28) with its sign corrected, (..., 3) N.

        Args:
            w: the acceleration that the grasp is to have, (..., 3) m/s².
        """
        return (self.inertia @ w[..., None])[..., 0] + self.bias


def task_inertia(robot: RobotParams, pitch: Array) -> Array:
    """Return 𝓜 = (J_A M_r⁻¹ J_Aᵀ)⁻¹ of Eq. (4) in the base frame, shape (..., 3, 3), kg."""
    still = np.zeros_like(pitch)
    return task_space_dynamics(robot, pitch, still, still).inertia


def task_space_dynamics(
    robot: RobotParams, pitch: Array, pitch_rate: Array, base_velocity: Array
) -> TaskSpaceDynamics:
    """Return 𝓜, 𝒞 = 𝓜 J_A M_r⁻¹ C_r − 𝓜 J̇_A u and J̄_A = M_r⁻¹ J_Aᵀ 𝓜 of Eq. (4).

    Args:
        robot: the robot alone.
        pitch: α of the arm, (..., 2) rad, away from a straight or folded elbow and ρ = 0.
        pitch_rate: α̇, (..., 2) rad/s.
        base_velocity: (u1, u2), (..., 2) m/s, rad/s.
    """
    arm = ArmKinematics(robot)
    inertia, bias = robot_dynamics(robot, pitch, pitch_rate, base_velocity)
    jacobian = arm.task_jacobian(pitch)
    compliance = np.linalg.solve(inertia, np.swapaxes(jacobian, -1, -2))
    task = np.linalg.inv(jacobian @ compliance)
    pseudoinverse = compliance @ task
    moving = arm.task_bias_acceleration(pitch, pitch_rate, base_velocity)
    return TaskSpaceDynamics(
        inertia=task,
        bias=np.einsum("...ji,...j->...i", pseudoinverse, bias)
        - np.einsum("...ij,...j->...i", task, moving),
        pseudoinverse=pseudoinverse,
    )


def combined_task_dynamics(
    robot: RobotParams,
    beam: BeamParams,
    pitch: Array,
    pitch_rate: Array,
    base_velocity: Array,
    swing: Array,
    swing_rate: Array,
) -> CombinedTaskDynamics:
    """Return the terms of Eq. (8): Eq. (3) with Eq. (6a) for F and z̈_2 eliminated by (6b).

    Args:
        robot: the robot alone.
        beam: the beam it holds.
        pitch: α of the arm, (..., 2) rad.
        pitch_rate: α̇, (..., 2) rad/s.
        base_velocity: (u1, u2), (..., 2) m/s, rad/s.
        swing: φ, (..., N) rad.
        swing_rate: φ̇, (..., N) rad/s.
    """
    task = task_space_dynamics(robot, pitch, pitch_rate, base_velocity)
    model = HangingBeam(beam)
    partition = model.partition(swing, swing_rate, base_velocity[..., 1])
    return CombinedTaskDynamics(
        inertia=task.inertia + model.apparent_inertia(partition),
        bias=task.bias + model.bias_force(partition, swing, swing_rate),
    )
