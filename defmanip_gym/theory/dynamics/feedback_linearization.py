"""Joint-space control that realizes Eq. (28): accelerations of Section IV.B put into Eq. (7)."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams
from defmanip_gym.theory.dynamics.chain import (
    Array,
    ChainConstants,
    mass_matrix_at,
    solve_positive_definite,
    velocity_bias_at,
)
from defmanip_gym.theory.dynamics.redundancy import (
    ReachRule,
    RedundancyResolution,
    shared_acceleration,
)
from defmanip_gym.theory.dynamics.robot_model import ArmLengths, robot_chain
from defmanip_gym.theory.payload.object_model import HangingBeam, hanging_pitch


class NominalModel(NamedTuple):
    """What the feedback linearization believes (compiled code takes named tuples)."""

    chain: ChainConstants
    arm: ArmLengths
    rule: ReachRule
    d_o22: Array
    k_o22: Array


class StateRoom(NamedTuple):
    """Where one state of the chain of L = 2 + N links is put, and the terms of Eq. (7) for it.

    Attributes:
        swing: φ, (N,) rad.
        velocity: v = (u1, u2, α̇), (2 + L,).
        acceleration: v̇, (2 + L,).
        cosine: cos α, (L,).
        sine: sin α, (L,).
        M: (2 + L, 2 + L).
        h: (2 + L,).
    """

    swing: Array
    velocity: Array
    acceleration: Array
    cosine: Array
    sine: Array
    M: Array
    h: Array

    @classmethod
    def empty(cls, segments: int) -> StateRoom:
        """Return room for a robot with a beam of N segments."""
        links = 2 + segments
        size = 2 + links
        return cls(
            swing=np.empty(segments),
            velocity=np.empty(size),
            acceleration=np.empty(size),
            cosine=np.empty(links),
            sine=np.empty(links),
            M=np.empty((size, size)),
            h=np.empty(size),
        )


class FeedbackLinearization:
    """Computed generalized forces T_r for a task-space acceleration, from nominal parameters.

    Args:
        robot: nominal robot.
        beam: nominal beam; overestimating its damping takes damping from the real one
            (docs/derivations.md). None for the robot alone, Eq. (2), whose swing is (n, 0).
        resolution: how base and arm share the task.
    """

    def __init__(
        self, robot: RobotParams, beam: BeamParams | None, resolution: RedundancyResolution
    ) -> None:
        carried = None if beam is None else HangingBeam(beam)
        self.model = NominalModel(
            chain=robot_chain(robot, beam).constants,
            arm=resolution.kinematics.lengths,
            rule=resolution.rule,
            d_o22=np.zeros((0, 0)) if carried is None else carried.d_o22,
            k_o22=np.zeros((0, 0)) if carried is None else carried.k_o22,
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
            StateRoom.empty(swing.shape[1]),
            forces,
        )
        return forces


@compilable
def generalized_forces_at(
    model: NominalModel,
    w_forward: float,
    w_left: float,
    w_up: float,
    upper: float,
    fore: float,
    state: StateRoom,
    forces: Array,
    i: int,
) -> None:
    """Write T_r of Eq. (28) for one state into row i of ``forces``, (n, 4) N and N·m.

    Args:
        model: what is believed.
        w_forward: task-space acceleration, m/s², base frame.
        w_left: to the left.
        w_up: and upwards.
        upper: α1, rad.
        fore: α2, rad.
        state: swing and velocity filled in; the rest is written.
        forces: the result.
        i: its row.
    """
    velocity, acceleration = state.velocity, state.acceleration
    cosine, sine, M, h = state.cosine, state.sine, state.M, state.h
    cosine[0], sine[0] = cos(upper), sin(upper)
    cosine[1], sine[1] = cos(fore), sin(fore)
    for j in range(len(state.swing)):
        alpha = hanging_pitch(state.swing[j])
        cosine[2 + j], sine[2 + j] = cos(alpha), sin(alpha)
    mass_matrix_at(model.chain, cosine, sine, M)
    velocity_bias_at(model.chain, cosine, sine, velocity, h)
    _add_position_forces(model, cosine, state.swing, velocity, h)
    # the grasp gets the acceleration w, and the beam moves as it must
    acceleration[0], acceleration[1], acceleration[2], acceleration[3] = shared_acceleration(
        model.arm,
        model.rule,
        w_forward,
        w_left,
        w_up,
        upper,
        fore,
        velocity[2],
        velocity[3],
        velocity[0],
        velocity[1],
    )
    for j in range(4, len(h)):
        acceleration[j] = -h[j]
        for k in range(4):
            acceleration[j] -= M[j, k] * acceleration[k]
    solve_positive_definite(M, acceleration, 4)
    for j in range(4):
        forces[i, j] = h[j]
        for k in range(len(h)):
            forces[i, j] += M[j, k] * acceleration[k]
    # from forces conjugate to α̇ to torques conjugate to q̇_a
    forces[i, 2] += forces[i, 3]


@compilable
def _add_position_forces(
    model: NominalModel, cosine: Array, swing: Array, velocity: Array, h: Array
) -> None:
    """Complete h of Eq. (7): gravity, the beam's dampers and springs."""
    for j in range(len(cosine)):
        h[2 + j] += GRAVITY_M_S2 * model.chain.first_moments[j] * cosine[j]
    for j in range(len(swing)):
        for k in range(len(swing)):
            h[4 + j] += model.d_o22[j, k] * velocity[4 + k] + model.k_o22[j, k] * swing[k]


@compiled
def _generalized_forces(
    model: NominalModel,
    w: Array,
    joints: Array,
    joint_rates: Array,
    base_velocity: Array,
    swing: Array,
    swing_rate: Array,
    state: StateRoom,
    forces: Array,
) -> None:
    _, segments = swing.shape
    for i in range(len(w)):
        upper, upper_rate = joints[i, 0], joint_rates[i, 0]
        state.velocity[0], state.velocity[1] = base_velocity[i, 0], base_velocity[i, 1]
        state.velocity[2], state.velocity[3] = upper_rate, upper_rate + joint_rates[i, 1]
        for k in range(segments):
            state.swing[k], state.velocity[4 + k] = swing[i, k], swing_rate[i, k]
        generalized_forces_at(
            model,
            w[i, 0],
            w[i, 1],
            w[i, 2],
            upper,
            upper + joints[i, 1],
            state,
            forces,
            i,
        )
