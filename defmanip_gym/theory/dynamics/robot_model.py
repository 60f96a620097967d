"""Mobile manipulator of Section II.A: grasp kinematics (1) and dynamics (2), combined form (7).

Configuration of the arm: relative joint angles q_a = (q1, q2), absolute pitches α = (q1, q1 + q2).
Quasi-velocities u = (u1, u2, q̇1, q̇2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import Numbers, compilable
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.dynamics.chain import Array, YawingChain, arm_links, beam_links

# α̇ = JOINT_TO_PITCH q̇_a for the two joints of the arm
JOINT_TO_PITCH = np.array([[1.0, 0.0], [1.0, 1.0]])
PITCH_TO_JOINT = np.linalg.inv(JOINT_TO_PITCH)
# (u1, u2, α̇) = QUASI_TO_PITCH u for the quasi-velocities u = (u1, u2, q̇_a)
QUASI_TO_PITCH = np.block([[np.eye(2), np.zeros((2, 2))], [np.zeros((2, 2)), JOINT_TO_PITCH]])


class ArmLengths(NamedTuple):
    """What the arm's kinematics depend on (compiled code takes named tuples)."""

    upper_arm_m: float
    forearm_m: float
    shoulder_height_m: float

    @classmethod
    def of(cls, robot: RobotParams) -> ArmLengths:
        """Return the lengths of a robot's arm."""
        return cls(
            float(robot.upper_arm.length_m),
            float(robot.forearm.length_m),
            float(robot.shoulder_height_m),
        )


@compilable
def reach_and_height(arm: ArmLengths, upper: Numbers, fore: Numbers) -> tuple[Numbers, Numbers]:
    """Return ρ and z of the grasp, (...) m each, for the pitches α1, α2 (...) rad."""
    reach = arm.upper_arm_m * np.cos(upper) + arm.forearm_m * np.cos(fore)
    height = arm.upper_arm_m * np.sin(upper) + arm.forearm_m * np.sin(fore)
    return reach, height + arm.shoulder_height_m


@compilable
def reach_and_height_slopes(
    arm: ArmLengths, upper: Numbers, fore: Numbers
) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return ∂ρ/∂α1, ∂ρ/∂α2, ∂z/∂α1, ∂z/∂α2, (...) m/rad each."""
    return (
        -arm.upper_arm_m * np.sin(upper),
        -arm.forearm_m * np.sin(fore),
        arm.upper_arm_m * np.cos(upper),
        arm.forearm_m * np.cos(fore),
    )


@compilable
def reach_and_height_bias(
    arm: ArmLengths, upper: Numbers, fore: Numbers, upper_rate: Numbers, fore_rate: Numbers
) -> tuple[Numbers, Numbers]:
    """Return ρ̈ and z̈ at α̈ = 0, (...) m/s² each."""
    rho_1, rho_2, z_1, z_2 = reach_and_height_slopes(arm, upper, fore)
    squared_1, squared_2 = upper_rate**2, fore_rate**2
    return -z_1 * squared_1 - z_2 * squared_2, rho_1 * squared_1 + rho_2 * squared_2


@compilable
def grasp_velocity(
    arm: ArmLengths,
    upper: Numbers,
    fore: Numbers,
    upper_rate: Numbers,
    fore_rate: Numbers,
    u1: Numbers,
    u2: Numbers,
) -> tuple[Numbers, Numbers, Numbers]:
    """Return ẋ_a = J_A u, Eq. (1), in the base frame: forward, left and up, (...) m/s each."""
    rho_1, rho_2, z_1, z_2 = reach_and_height_slopes(arm, upper, fore)
    forward = u1 + rho_1 * upper_rate + rho_2 * fore_rate
    reach, _ = reach_and_height(arm, upper, fore)
    return forward, reach * u2, z_1 * upper_rate + z_2 * fore_rate


class ArmKinematics:
    """Where the grasp is, and how it moves: Eq. (1) in the base frame.

    Args:
        robot: lengths and shoulder height.
    """

    def __init__(self, robot: RobotParams) -> None:
        self.lengths = ArmLengths.of(robot)

    def reach_and_height(self, pitch: Array) -> Array:
        """Return (ρ, z), shape (..., 2) in m, of the grasp for pitches (..., 2) in rad."""
        return np.stack(reach_and_height(self.lengths, *components(pitch)), axis=-1)

    def jacobian(self, pitch: Array) -> Array:
        """Return d(ρ, z)/dα, shape (..., 2, 2), in m/rad."""
        slopes = np.stack(reach_and_height_slopes(self.lengths, *components(pitch)), axis=-1)
        return slopes.reshape(*slopes.shape[:-1], 2, 2)

    def bias_acceleration(self, pitch: Array, pitch_rate: Array) -> Array:
        """Return (ρ̈, z̈) at α̈ = 0, shape (..., 2) in m/s²."""
        return np.stack(
            reach_and_height_bias(self.lengths, *components(pitch), *components(pitch_rate)),
            axis=-1,
        )

    def task_jacobian(self, pitch: Array) -> Array:
        """Return J_A of Eq. (1) in the base frame, shape (..., 3, 4), for u = (u1, u2, q̇1, q̇2)."""
        reach = self.reach_and_height(pitch)[..., 0]
        arm = self.jacobian(pitch) @ JOINT_TO_PITCH
        jacobian = np.zeros((*reach.shape, 3, 4))
        jacobian[..., 0, 0] = 1.0
        jacobian[..., 1, 1] = reach
        jacobian[..., 0, 2:] = arm[..., 0, :]
        jacobian[..., 2, 2:] = arm[..., 1, :]
        return jacobian

    def task_bias_acceleration(
        self, pitch: Array, pitch_rate: Array, base_velocity: Array
    ) -> Array:
        """Return J̇_A u, shape (..., 3) m/s²: the grasp's inertial acceleration at u̇ = 0.

        Base frame, so it holds what turning the frame adds: ẍ_a = J_A u̇ + J̇_A u is inertial.
        """
        u1, u2 = base_velocity[..., 0], base_velocity[..., 1]
        reach = self.reach_and_height(pitch)[..., 0]
        reach_rate = (self.jacobian(pitch)[..., 0, :] * pitch_rate).sum(-1)
        bias = self.bias_acceleration(pitch, pitch_rate)
        return np.stack(
            (bias[..., 0] - reach * u2**2, 2 * reach_rate * u2 + u1 * u2, bias[..., 1]), axis=-1
        )


def components(vectors: Array) -> tuple[Array, ...]:
    """Return the components, (...) each, of vectors (..., k)."""
    return tuple(np.moveaxis(vectors, -1, 0))


def robot_chain(robot: RobotParams, beam: BeamParams | None = None) -> YawingChain:
    """Return the chain of the robot alone, Eq. (2), or carrying the beam, Eq. (7)."""
    links = arm_links(robot) + (beam_links(beam) if beam is not None else ())
    rotor = np.zeros((len(links), len(links)))
    rotor[:2, :2] = robot.joint_armature_kgm2 * PITCH_TO_JOINT.T @ PITCH_TO_JOINT
    return YawingChain(
        links,
        base_mass_kg=robot.base_mass_kg,
        base_yaw_inertia_kgm2=robot.base_yaw_inertia_kgm2,
        rotor_inertia=rotor,
    )


def robot_dynamics(
    robot: RobotParams, pitch: Array, pitch_rate: Array, base_velocity: Array
) -> tuple[Array, Array]:
    """Return M_r, (..., 4, 4), and C_r with gravity, (..., 4), of Eq. (2) for u = (u1, u2, q̇_a).

    Args:
        robot: the robot alone, without an object.
        pitch: α of the arm, (..., 2) rad.
        pitch_rate: α̇, (..., 2) rad/s.
        base_velocity: (u1, u2), (..., 2) m/s, rad/s.
    """
    chain = robot_chain(robot)
    velocity = np.concatenate((base_velocity, pitch_rate), axis=-1)
    inertia = QUASI_TO_PITCH.T @ chain.mass_matrix(pitch) @ QUASI_TO_PITCH
    return inertia, chain.bias(pitch, velocity) @ QUASI_TO_PITCH
