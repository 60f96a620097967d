"""Planar chain of links on a yawing unicycle: the one model behind Eqs. (2), (5) and (7).

Every arm link and every beam segment is a link in the vertical plane through the heading. With
absolute pitch angles α and quasi-velocities v = (u1, u2, α̇) the dynamics are M(α) v̇ + h(α, v) =
generalized forces. The nonholonomic constraint is built in: v has no lateral speed. Derivation:
docs/derivations.md.

With A_ij the distance that link j puts between base axis and centre of mass i, all of it depends
on two constants: p_j = Σ_i m_i A_ij and W_jk = Σ_i m_i A_ij A_ik.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, LinkParams, RobotParams

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Link:
    """One rigid rod: its centre of mass lies ``com_m`` from the previous joint."""

    length_m: float
    com_m: float
    mass_kg: float
    transverse_inertia_kgm2: float
    axial_inertia_kgm2: float


def uniform_rod(length_m: float, mass_kg: float, radius_m: float) -> Link:
    """Return the link of a thin uniform rod (transverse inertia m l²/12)."""
    return Link(
        length_m=length_m,
        com_m=length_m / 2,
        mass_kg=mass_kg,
        transverse_inertia_kgm2=mass_kg * length_m**2 / 12,
        axial_inertia_kgm2=mass_kg * radius_m**2 / 2,
    )


def arm_links(robot: RobotParams) -> tuple[Link, ...]:
    """Return the links of the arm, shoulder to grasp."""

    def rod(link: LinkParams) -> Link:
        return uniform_rod(link.length_m, link.mass_kg, link.radius_m)

    return (rod(robot.upper_arm), rod(robot.forearm))


def beam_links(beam: BeamParams) -> tuple[Link, ...]:
    """Return the segments of the beam, grasp to tip."""
    segment = uniform_rod(beam.segment_length_m, beam.segment_mass_kg, beam.radius_m)
    return (segment,) * beam.segment_count


class ChainConstants(NamedTuple):
    """What the dynamics of a chain of L links depend on (compiled code takes named tuples).

    Attributes:
        total_mass: of base and links, kg.
        base_yaw_inertia: kg·m².
        first_moments: p, (L,) kg·m: what gravity and forward acceleration act on.
        second_moments: W, (L, L) kg·m².
        constant_inertia: (L, L) kg·m², the links' own inertia and the rotors'.
        transverse: own inertia of each link across its axis, (L,) kg·m².
        axial: about its axis, (L,) kg·m².
    """

    total_mass: float
    base_yaw_inertia: float
    first_moments: Array
    second_moments: Array
    constant_inertia: Array
    transverse: Array
    axial: Array


class YawingChain:
    """Links in series, pitching in the vertical plane of a base that drives and yaws.

    Args:
        links: the links in order; the first hangs from the base axis.
        base_mass_kg: mass of the base, 0 for a chain held at a moving point.
        base_yaw_inertia_kgm2: its inertia about the vertical.
        rotor_inertia: (L, L) reflected rotor inertia in the rates α̇, or None.
    """

    def __init__(
        self,
        links: tuple[Link, ...],
        *,
        base_mass_kg: float = 0.0,
        base_yaw_inertia_kgm2: float = 0.0,
        rotor_inertia: Array | None = None,
    ) -> None:
        count = len(links)
        lengths = np.array([link.length_m for link in links])
        masses = np.array([link.mass_kg for link in links])
        transverse = np.array([link.transverse_inertia_kgm2 for link in links])
        # row i: the lengths of the links before i, then the distance of its own centre of mass
        geometry = np.tril(np.tile(lengths, (count, 1)), -1) + np.diag([k.com_m for k in links])
        constant_inertia = np.diag(transverse)
        if rotor_inertia is not None:
            constant_inertia = constant_inertia + rotor_inertia
        self.link_count = count
        self.constants = ChainConstants(
            total_mass=float(base_mass_kg + masses.sum()),
            base_yaw_inertia=float(base_yaw_inertia_kgm2),
            first_moments=masses @ geometry,
            second_moments=geometry.T @ (masses[:, None] * geometry),
            constant_inertia=constant_inertia,
            transverse=transverse,
            axial=np.array([link.axial_inertia_kgm2 for link in links]),
        )

    def mass_matrix(self, alpha: Array) -> Array:
        """Return M(α), (..., 2 + L, 2 + L), for v = (u1, u2, α̇); ``alpha`` (..., L) rad."""
        size = 2 + self.link_count
        matrix = np.empty((*np.shape(alpha)[:-1], size, size))
        cosine, sine = np.empty(self.link_count), np.empty(self.link_count)
        _mass_matrices(self.constants, _rows(alpha), cosine, sine, matrix.reshape(-1, size, size))
        return matrix

    def velocity_bias(self, alpha: Array, velocity: Array) -> Array:
        """Return h(α, v) without gravity, (..., 2 + L); ``velocity`` is v, (..., 2 + L)."""
        rows = _rows(velocity)
        bias = np.empty_like(rows)
        cosine, sine = np.empty(self.link_count), np.empty(self.link_count)
        _velocity_biases(self.constants, _rows(alpha), rows, cosine, sine, bias)
        return bias.reshape(np.shape(velocity))

    def gravity_torque(self, alpha: Array) -> Array:
        """Return the gravity part of h_α, (..., L) in N·m."""
        return GRAVITY_M_S2 * self.constants.first_moments * np.cos(alpha)

    def bias(self, alpha: Array, velocity: Array) -> Array:
        """Return h(α, v) with gravity, (..., 2 + L)."""
        bias = self.velocity_bias(alpha, velocity)
        bias[..., 2:] += self.gravity_torque(alpha)
        return bias


@compilable
def mass_matrix_at(chain: ChainConstants, cosine: Array, sine: Array, M: Array) -> None:
    """Write M(α) of one state into ``M``, (2 + L, 2 + L).

    Args:
        chain: its constants.
        cosine: cos α, (L,).
        sine: sin α, (L,).
        M: the result.
    """
    p, W = chain.first_moments, chain.second_moments
    yaw_inertia = chain.base_yaw_inertia
    for j in range(len(cosine)):
        M[0, 2 + j] = M[2 + j, 0] = -p[j] * sine[j]
        M[1, 2 + j] = M[2 + j, 1] = 0.0
        yaw_inertia += chain.transverse[j] * cosine[j] ** 2 + chain.axial[j] * sine[j] ** 2
        for k in range(len(cosine)):
            yaw_inertia += W[j, k] * cosine[j] * cosine[k]
            # cos(α_j − α_k)
            turned = cosine[j] * cosine[k] + sine[j] * sine[k]
            M[2 + j, 2 + k] = W[j, k] * turned + chain.constant_inertia[j, k]
    M[0, 0], M[1, 1], M[0, 1], M[1, 0] = chain.total_mass, yaw_inertia, 0.0, 0.0


@compilable
def velocity_bias_at(
    chain: ChainConstants, cosine: Array, sine: Array, velocity: Array, h: Array
) -> None:
    """Write h(α, v) of one state without gravity into ``h``, (2 + L,).

    Args:
        chain: its constants.
        cosine: cos α, (L,).
        sine: sin α, (L,).
        velocity: v = (u1, u2, α̇), (2 + L,).
        h: the result.
    """
    p, W = chain.first_moments, chain.second_moments
    u1, u2 = velocity[0], velocity[1]
    h[0] = coriolis = 0.0
    for j in range(len(cosine)):
        h[0] -= p[j] * cosine[j] * (velocity[2 + j] ** 2 + u2**2)
        slope = (chain.axial[j] - chain.transverse[j]) * sine[j] * cosine[j]
        coriolis += p[j] * cosine[j] * u1 + 2 * slope * velocity[2 + j]
        h[2 + j] = -slope * u2**2
        for k in range(len(cosine)):
            coriolis -= 2 * W[j, k] * cosine[j] * sine[k] * velocity[2 + k]
            h[2 + j] += W[j, k] * sine[j] * cosine[k] * u2**2
            # sin(α_j − α_k)
            turned = sine[j] * cosine[k] - cosine[j] * sine[k]
            h[2 + j] += W[j, k] * turned * velocity[2 + k] ** 2
    h[1] = u2 * coriolis


@compilable
def solve_positive_definite(A: Array, b: Array, first: int) -> None:
    """Turn b into A⁻¹ b by elimination, A into its triangular factor, from row ``first`` on.

    Positive definite matrices need no pivots; LAPACK's solver costs more than all the rest here.

    Args:
        A: its block from row and column ``first`` on counts, (k, k).
        b: right-hand side and result, (k,).
        first: 0 for all of them.
    """
    for j in range(first, len(b)):
        for i in range(j + 1, len(b)):
            factor = A[i, j] / A[j, j]
            b[i] -= factor * b[j]
            for k in range(j, len(b)):
                A[i, k] -= factor * A[j, k]
    for j in range(len(b) - 1, first - 1, -1):
        for k in range(j + 1, len(b)):
            b[j] -= A[j, k] * b[k]
        b[j] /= A[j, j]


@compiled
def _mass_matrices(
    chain: ChainConstants, alpha: Array, cosine: Array, sine: Array, M: Array
) -> None:
    for i in range(len(alpha)):
        _directions(alpha[i], cosine, sine)
        mass_matrix_at(chain, cosine, sine, M[i])


@compiled
def _velocity_biases(
    chain: ChainConstants, alpha: Array, velocity: Array, cosine: Array, sine: Array, h: Array
) -> None:
    for i in range(len(alpha)):
        _directions(alpha[i], cosine, sine)
        velocity_bias_at(chain, cosine, sine, velocity[i], h[i])


@compilable
def _directions(alpha: Array, cosine: Array, sine: Array) -> None:
    for j in range(len(alpha)):
        cosine[j], sine[j] = cos(alpha[j]), sin(alpha[j])


def _rows(values: Array) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64).reshape(-1, np.shape(values)[-1])
