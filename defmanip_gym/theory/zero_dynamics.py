"""Zero dynamics of Section III: equilibrium (12), linearization (16), its Lyapunov matrix."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.chain import Array
from defmanip_gym.theory.object_model import HangingBeam


@dataclass(frozen=True, kw_only=True)
class LinearizedObject:
    """η̇ = A_u η + B_u ν of Eq. (16), with what perturbs its stiffness.

    η = (z2 − z2*, ż2), 2N states; ν = (0, ż1, z̈1) of Eq. (14), in the base frame.

    Attributes:
        A_u: (2N, 2N).
        B_u: (2N, 9); only its last three columns differ from zero.
        vertical_stiffness: (2N, N), effect on η̇ of φ at a vertical acceleration of 1 m/s².
        centrifugal_stiffness: (2N, N), effect on η̇ of φ at a yaw rate of 1 rad/s.
    """

    A_u: Array
    B_u: Array
    vertical_stiffness: Array
    centrifugal_stiffness: Array

    @property
    def count(self) -> int:
        """Number N of internal coordinates (the paper's n − m)."""
        return self.A_u.shape[0] // 2

    @property
    def forward_input(self) -> Array:
        """Column of B_u for the forward grasp acceleration, (2N,)."""
        return self.B_u[:, 6]


def equilibrium(beam: BeamParams) -> Array:
    """Return z2* of Eq. (12), (N,) rad: the beam hangs straight down."""
    return np.zeros(beam.segment_count)


def linearize(beam: BeamParams) -> LinearizedObject:
    """Return the linearization (16) of the zero dynamics about hanging at rest."""
    model = HangingBeam(beam)
    count, chain = model.count, model.chain
    rest = np.zeros(count)
    partition = model.partition(rest, rest, np.zeros(()))
    inverse = np.linalg.inv(partition.m_o22)
    gravity_slope = np.diag(chain.first_moments)
    stiffness = model.k_o22 + GRAVITY_M_S2 * gravity_slope
    centrifugal = chain.geometry.T @ (chain.masses[:, None] * chain.geometry) + np.diag(
        chain.transverse - chain.axial
    )
    zero, unit = np.zeros((count, count)), np.eye(count)
    A_u = np.block([[zero, unit], [-inverse @ stiffness, -inverse @ model.d_o22]])
    B_u = np.zeros((2 * count, 9))
    B_u[count:, 6:] = -inverse @ partition.m_o12.T
    return LinearizedObject(
        A_u=A_u,
        B_u=B_u,
        vertical_stiffness=np.vstack((zero, -inverse @ gravity_slope)),
        centrifugal_stiffness=np.vstack((zero, inverse @ centrifugal)),
    )


def is_hurwitz(A: Array) -> bool:
    """Whether all eigenvalues of A lie in the open left half plane (Lemma III.2)."""
    return bool(np.linalg.eigvals(A).real.max() < 0)


def lyapunov_matrix(A: Array) -> Array:
    """Return P with P A + Aᵀ P = −I (below Lemma III.2), same shape as the Hurwitz A."""
    return np.asarray(control.lyap(A.T, np.eye(A.shape[0])))
