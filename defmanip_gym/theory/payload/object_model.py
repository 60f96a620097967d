"""Deformable object of Section II.B: the partition (6), the linearizing force (10) and its inverse.

z1 is the grasp position, z2 = (φ_1, …, φ_N) the segment angles from the vertical. Task-space
vectors are in the base frame (theory/__init__): there m_o12 does not depend on the heading.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from defmanip_gym.compiled import Numbers, compilable, compiled
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.dynamics.chain import (
    Array,
    ChainConstants,
    YawingChain,
    beam_links,
    solve_positive_definite,
)


@compilable
def hanging_pitch(swing: Numbers) -> Numbers:
    """Return the pitch α = φ − π/2 of a hanging segment at swing φ, rad."""
    return swing - np.pi / 2


def segment_coupling(count: int, first: float, between: float) -> Array:
    """Return the (N, N) matrix of a root spring (or damper) and equal ones between neighbours."""
    relative = np.eye(count) - np.eye(count, k=-1)
    return relative.T @ np.diag([first] + [between] * (count - 1)) @ relative


@dataclass(frozen=True, kw_only=True)
class ObjectPartition:
    """The terms of Eqs. (6a), (6b) at one state; N internal coordinates.

    Attributes:
        m_o11: (3, 3) kg.
        m_o12: (..., 3, N) kg·m.
        m_o22: (..., N, N) kg·m².
        c_o1: (..., 3) N, centrifugal and Coriolis terms.
        c_o2: (..., N) N·m.
        t_o1: (3,) N, gravity.
        t_o2: (..., N) N·m.
    """

    m_o11: Array
    m_o12: Array
    m_o22: Array
    c_o1: Array
    c_o2: Array
    t_o1: Array
    t_o2: Array


class HangingBeam:
    """A beam of N segments hanging from a grasp that accelerates and yaws.

    Args:
        beam: its parameters.
        damping: the damping from the vertical that this model assumes; the beam's own if None.
            The force law may assume another damping than the plant has (docs/derivations.md).
    """

    def __init__(self, beam: BeamParams, *, damping: float | None = None) -> None:
        self.chain = YawingChain(beam_links(beam))
        self.count = beam.segment_count
        root_damping = beam.damping if damping is None else damping
        if not np.isfinite(root_damping):
            raise ParameterError("damping", damping, "a finite number", "Give N m s/rad.")
        # d_o21 = k_o21 = 0: damper and springs are tied to the vertical and to one another
        self.d_o22 = segment_coupling(self.count, root_damping, beam.joint_damping)
        self.k_o22 = segment_coupling(self.count, beam.root_stiffness, beam.joint_stiffness)

    def partition(self, swing: Array, swing_rate: Array, yaw_rate: Array) -> ObjectPartition:
        """Return the terms of Eq. (6).

        Args:
            swing: φ, (..., N) rad.
            swing_rate: φ̇, (..., N) rad/s.
            yaw_rate: u2, (...) rad/s.
        """
        chain, alpha, u2 = self.chain, hanging_pitch(swing), np.asarray(yaw_rate)
        moments, total = chain.constants.first_moments, chain.constants.total_mass
        velocity = np.concatenate(
            (np.zeros((*u2.shape, 1)), u2[..., None], np.asarray(swing_rate)), axis=-1
        )
        forward, upward = -moments * np.sin(alpha), moments * np.cos(alpha)
        bias = chain.velocity_bias(alpha, velocity)
        c_o1 = np.stack(
            (
                bias[..., 0],
                2 * u2 * (forward * swing_rate).sum(-1),
                (forward * swing_rate**2).sum(-1),
            ),
            axis=-1,
        )
        return ObjectPartition(
            m_o11=total * np.eye(3),
            m_o12=np.stack((forward, np.zeros_like(forward), upward), axis=-2),
            m_o22=chain.mass_matrix(alpha)[..., 2:, 2:],
            c_o1=c_o1,
            c_o2=bias[..., 2:],
            t_o1=np.array([0.0, 0.0, total * GRAVITY_M_S2]),
            t_o2=chain.gravity_torque(alpha),
        )

    def apparent_inertia(self, partition: ObjectPartition) -> Array:
        """Return m̃_o11 = m_o11 − m_o12 m_o22⁻¹ m_o12ᵀ, shape (..., 3, 3), kg."""
        coupling = np.swapaxes(partition.m_o12, -1, -2)
        return partition.m_o11 - partition.m_o12 @ np.linalg.solve(partition.m_o22, coupling)

    def bias_force(self, partition: ObjectPartition, swing: Array, swing_rate: Array) -> Array:
        """Return c̃_o1 + d̃_o1 ż + k̃_o1 z + t̃_o1 of Eq. (10), shape (..., 3), N."""
        torque = self.internal_torque(partition, swing, swing_rate)
        return (
            partition.c_o1
            + partition.t_o1
            - (partition.m_o12 @ np.linalg.solve(partition.m_o22, torque[..., None]))[..., 0]
        )

    def internal_torque(self, partition: ObjectPartition, swing: Array, swing_rate: Array) -> Array:
        """Return c_o2 + d_o2 ż + k_o2 z + t_o2 of Eq. (6b), shape (..., N), N·m."""
        return (
            partition.c_o2
            + partition.t_o2
            + np.einsum("jk,...k->...j", self.d_o22, swing_rate)
            + np.einsum("jk,...k->...j", self.k_o22, swing)
        )

    def linearizing_force(
        self, swing: Array, swing_rate: Array, yaw_rate: Array, u_o: Array
    ) -> Array:
        """Return the force F of Eq. (10) that gives the grasp the acceleration u_o, (..., 3) N."""
        partition = self.partition(swing, swing_rate, yaw_rate)
        inertia = self.apparent_inertia(partition)
        return self.bias_force(partition, swing, swing_rate) + (inertia @ u_o[..., None])[..., 0]

    def acceleration_error(
        self, swing: Array, swing_rate: Array, yaw_rate: Array, u_o: Array, force: Array
    ) -> Array:
        """Return Δu_o = m̃_o11⁻¹ (f̃ − f) of Section IV, (..., 3) m/s².

        Args:
            swing: φ, (..., N) rad.
            swing_rate: φ̇, (..., N) rad/s.
            yaw_rate: u2, (...) rad/s.
            u_o: the acceleration asked for, (..., 3) m/s².
            force: f̃, the measured force on the object, (..., 3) N.
        """
        partition = self.partition(swing, swing_rate, yaw_rate)
        excess = force - self.bias_force(partition, swing, swing_rate)
        return np.linalg.solve(self.apparent_inertia(partition), excess[..., None])[..., 0] - u_o


@compiled
def held_forces(
    chain: ChainConstants,
    k_o22: Array,
    mass_share: Array,
    length_share: Array,
    swing: Array,
    inertia: Array,
    acceleration: Array,
    force: Array,
) -> None:
    """Write the force (10) on beams at rest whose grasp is held still.

    Args:
        chain: constants of the reference beam.
        k_o22: its stiffness, (N, N) N·m/rad, which all beams share.
        mass_share: mass of each beam over the reference beam's, (n,).
        length_share: its length over the reference beam's, (n,).
        swing: φ, (n, N) rad.
        inertia: room for m_o22 of one beam, (N, N).
        acceleration: and for φ̈, (N,).
        force: the result in the base frame, (n, 3) N.
    """
    count, segments = swing.shape
    for i in range(count):
        mass, length = mass_share[i], length_share[i]
        for j in range(segments):
            moment = mass * length * chain.first_moments[j]
            acceleration[j] = -GRAVITY_M_S2 * moment * sin(swing[i, j])
            for k in range(segments):
                acceleration[j] -= k_o22[j, k] * swing[i, k]
                coupling = chain.second_moments[j, k] * cos(swing[i, j] - swing[i, k])
                inertia[j, k] = mass * length**2 * (coupling + chain.constant_inertia[j, k])
        solve_positive_definite(inertia, acceleration, 0)
        force[i, 0] = force[i, 1] = 0.0
        force[i, 2] = GRAVITY_M_S2 * mass * chain.total_mass
        for j in range(segments):
            moment = mass * length * chain.first_moments[j]
            force[i, 0] += moment * cos(swing[i, j]) * acceleration[j]
            force[i, 2] += moment * sin(swing[i, j]) * acceleration[j]
