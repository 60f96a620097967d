"""Joint-space control that realizes Eq. (28): accelerations of Section IV.B put into Eq. (7)."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compiled
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams
from defmanip_gym.theory.chain import (
    Array,
    ChainConstants,
    mass_matrix_at,
    solve_positive_definite,
    velocity_bias_at,
)
from defmanip_gym.theory.object_model import HangingBeam, hanging_pitch
from defmanip_gym.theory.redundancy import ReachRule, RedundancyResolution, shared_acceleration
from defmanip_gym.theory.robot_model import ArmLengths, robot_chain


class NominalModel(NamedTuple):
    """What the feedback linearization believes (compiled code takes named tuples)."""

    chain: ChainConstants
    arm: ArmLengths
    rule: ReachRule
    d_o22: Array
    k_o22: Array


class FeedbackLinearization:
    """Computed generalized forces T_r for a task-space acceleration, from nominal parameters.

    Args:
        robot: nominal robot.
        beam: nominal beam; overestimating its damping takes damping from the real one
            (docs/derivations.md).
        resolution: how base and arm share the task.
    """

    def __init__(
        self, robot: RobotParams, beam: BeamParams, resolution: RedundancyResolution
    ) -> None:
        carried = HangingBeam(beam)
        self.model = NominalModel(
            chain=robot_chain(robot, beam).constants,
            arm=resolution.kinematics.lengths,
            rule=resolution.rule,
            d_o22=carried.d_o22,
            k_o22=carried.k_o22,
        )

    def generalized_forces(
        self,
        w: Array,
        joints: Array,
        joint_rates: Array,
        base_velocity: Array,
        swing: Array,
        swing_rate: Array,
    ) -> Array:
        """Return T_r = (f_b, α_b, τ1, τ2), shape (n, 4) in N and N·m.

        Args:
            w: task-space acceleration, (n, 3) m/s², base frame.
            joints: q_a, (n, 2) rad.
            joint_rates: q̇_a, (n, 2) rad/s.
            base_velocity: (u1, u2), (n, 2) m/s, rad/s.
            swing: φ, (n, N) rad.
            swing_rate: φ̇, (n, N) rad/s.
        """
        forces = np.empty((len(w), 4))
        _generalized_forces(
            self.model,
            np.ascontiguousarray(w),
            np.ascontiguousarray(joints),
            np.ascontiguousarray(joint_rates),
            np.ascontiguousarray(base_velocity),
            np.ascontiguousarray(swing),
            np.ascontiguousarray(swing_rate),
            forces,
        )
        return forces


@compiled
def generalized_forces_at(
    model: NominalModel,
    w: Array,
    joints: Array,
    joint_rates: Array,
    base_velocity: Array,
    swing: Array,
    swing_rate: Array,
    forces: Array,
) -> None:
    """Write T_r for one state into ``forces``, (4,); arguments as above without the n."""
    links = 2 + len(swing)
    alpha, cosine, sine = np.empty(links), np.empty(links), np.empty(links)
    velocity, M, h = np.empty(2 + links), np.empty((2 + links, 2 + links)), np.empty(2 + links)
    alpha[0], alpha[1] = joints[0], joints[0] + joints[1]
    velocity[0], velocity[1] = base_velocity[0], base_velocity[1]
    velocity[2], velocity[3] = joint_rates[0], joint_rates[0] + joint_rates[1]
    for j in range(len(swing)):
        alpha[2 + j], velocity[4 + j] = hanging_pitch(swing[j]), swing_rate[j]
    for j in range(links):
        cosine[j], sine[j] = cos(alpha[j]), sin(alpha[j])
    mass_matrix_at(model.chain, cosine, sine, M)
    velocity_bias_at(model.chain, cosine, sine, velocity, h)
    _add_position_forces(model, cosine, swing, swing_rate, h)
    _inverse_dynamics(model, w, alpha, velocity, M, h, forces)


@compiled
def _generalized_forces(
    model: NominalModel,
    w: Array,
    joints: Array,
    joint_rates: Array,
    base_velocity: Array,
    swing: Array,
    swing_rate: Array,
    forces: Array,
) -> None:
    for i in range(len(w)):
        generalized_forces_at(
            model,
            w[i],
            joints[i],
            joint_rates[i],
            base_velocity[i],
            swing[i],
            swing_rate[i],
            forces[i],
        )


@compiled
def _add_position_forces(
    model: NominalModel, cosine: Array, swing: Array, swing_rate: Array, h: Array
) -> None:
    """Complete h of Eq. (7): gravity, the beam's dampers and springs."""
    for j in range(len(cosine)):
        h[2 + j] += GRAVITY_M_S2 * model.chain.first_moments[j] * cosine[j]
    for j in range(len(swing)):
        for k in range(len(swing)):
            h[4 + j] += model.d_o22[j, k] * swing_rate[k] + model.k_o22[j, k] * swing[k]


@compiled
def _inverse_dynamics(
    model: NominalModel,
    w: Array,
    alpha: Array,
    velocity: Array,
    M: Array,
    h: Array,
    forces: Array,
) -> None:
    """Write the T_r that gives the grasp the acceleration w; the beam moves as it must.

    Overwrites the beam's part of M and h.
    """
    actuated = shared_acceleration(model.arm, model.rule, w, alpha[:2], velocity[2:4], velocity[:2])
    for j in range(4, len(h)):
        h[j] = -h[j]
        for k in range(4):
            h[j] -= M[j, k] * actuated[k]
    solve_positive_definite(M[4:, 4:], h[4:])
    for j in range(4):
        forces[j] = h[j]
        for k in range(4):
            forces[j] += M[j, k] * actuated[k]
        for k in range(4, len(h)):
            forces[j] += M[j, k] * h[k]
    # from forces conjugate to α̇ to torques conjugate to q̇_a
    forces[2] += forces[3]
