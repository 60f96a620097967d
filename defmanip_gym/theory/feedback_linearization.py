"""Joint-space control that realizes Eq. (28): accelerations of Section IV.B put into Eq. (7)."""

from __future__ import annotations

import numpy as np

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.chain import Array
from defmanip_gym.theory.object_model import HangingBeam, hanging_pitch
from defmanip_gym.theory.redundancy import RedundancyResolution
from defmanip_gym.theory.robot_model import JOINT_TO_PITCH, robot_chain


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
        self.chain = robot_chain(robot, beam)
        self.object = HangingBeam(beam)
        self.resolution = resolution

    def generalized_forces(
        self,
        w: Array,
        joints: Array,
        joint_rates: Array,
        base_velocity: Array,
        swing: Array,
        swing_rate: Array,
    ) -> Array:
        """Return T_r = (f_b, α_b, τ1, τ2), shape (..., 4) in N and N·m.

        Args:
            w: task-space acceleration, (..., 3) m/s², base frame.
            joints: q_a, (..., 2) rad.
            joint_rates: q̇_a, (..., 2) rad/s.
            base_velocity: (u1, u2), (..., 2) m/s, rad/s.
            swing: φ, (..., N) rad.
            swing_rate: φ̇, (..., N) rad/s.
        """
        pitch, pitch_rate = joints @ JOINT_TO_PITCH.T, joint_rates @ JOINT_TO_PITCH.T
        alpha = np.concatenate((pitch, hanging_pitch(swing)), axis=-1)
        velocity = np.concatenate((base_velocity, pitch_rate, swing_rate), axis=-1)
        terms = self.chain.terms(alpha, velocity[..., 2:])
        inertia = self.chain.mass_matrix(alpha, terms)
        bias = self.chain.bias(alpha, velocity, terms)
        actuated = self.resolution.accelerations(w, pitch, pitch_rate, base_velocity)
        passive_torque = (
            bias[..., 4:]
            + np.einsum("jk,...k->...j", self.object.d_o22, swing_rate)
            + np.einsum("jk,...k->...j", self.object.k_o22, swing)
            + np.einsum("...jk,...k->...j", inertia[..., 4:, :4], actuated)
        )
        free = -np.linalg.solve(inertia[..., 4:, 4:], passive_torque[..., None])[..., 0]
        accelerations = np.concatenate((actuated, free), axis=-1)
        forces = np.einsum("...jk,...k->...j", inertia[..., :4, :], accelerations) + bias[..., :4]
        # from forces conjugate to α̇ to torques conjugate to q̇_a
        forces[..., 2:] = forces[..., 2:] @ JOINT_TO_PITCH
        return forces
