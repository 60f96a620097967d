"""Planar chain of links on a yawing unicycle: the one model behind Eqs. (2), (5) and (7).

Every arm link and every beam segment is a link in the vertical plane through the heading. With
absolute pitch angles α and quasi-velocities v = (u1, u2, α̇) the dynamics are M(α) v̇ + h(α, v) =
generalized forces. The nonholonomic constraint is built in: v has no lateral speed. Derivation:
docs/derivations.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True, kw_only=True)
class ChainTerms:
    """What the chain's dynamics share at one state.

    Shapes for L links: ``jacobian_r``, ``jacobian_z`` (..., L, L) map α̇ to the velocities of the
    centres of mass; ``r``, ``r_dot``, ``r_bias``, ``z_bias`` are (..., L) in m, m/s, m/s².
    """

    jacobian_r: Array
    jacobian_z: Array
    r: Array
    r_dot: Array
    r_bias: Array
    z_bias: Array


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
        self.link_count = count
        self.masses = np.array([link.mass_kg for link in links])
        self.transverse = np.array([link.transverse_inertia_kgm2 for link in links])
        self.axial = np.array([link.axial_inertia_kgm2 for link in links])
        # row i: the lengths of the links before i, then the distance of its own centre of mass
        self.geometry = np.tril(np.tile(lengths, (count, 1)), -1) + np.diag(
            [k.com_m for k in links]
        )
        self.base_mass = base_mass_kg
        self.base_yaw_inertia = base_yaw_inertia_kgm2
        self._constant_inertia = np.diag(self.transverse)
        if rotor_inertia is not None:
            self._constant_inertia = self._constant_inertia + rotor_inertia

    @cached_property
    def first_moments(self) -> Array:
        """Σ_i m_i A_ik, shape (L,), in kg·m: what gravity and forward acceleration act on."""
        return self.masses @ self.geometry

    def terms(self, alpha: Array, alpha_dot: Array) -> ChainTerms:
        """Return positions, Jacobians and bias accelerations; α (..., L) rad, α̇ rad/s."""
        cos, sin = np.cos(alpha), np.sin(alpha)
        jacobian_r = -self.geometry * sin[..., None, :]
        squared = alpha_dot**2
        return ChainTerms(
            jacobian_r=jacobian_r,
            jacobian_z=self.geometry * cos[..., None, :],
            r=self._along(cos),
            r_dot=np.einsum("...ik,...k->...i", jacobian_r, alpha_dot),
            r_bias=-self._along(cos * squared),
            z_bias=-self._along(sin * squared),
        )

    def pitch_inertia(self, terms: ChainTerms) -> Array:
        """Return M_αα, shape (..., L, L), kg·m²."""
        weighted_r = terms.jacobian_r * self.masses[:, None]
        weighted_z = terms.jacobian_z * self.masses[:, None]
        return (
            np.einsum("...ij,...ik->...jk", terms.jacobian_r, weighted_r)
            + np.einsum("...ij,...ik->...jk", terms.jacobian_z, weighted_z)
            + self._constant_inertia
        )

    def pitch_bias(self, alpha: Array, terms: ChainTerms, u2: Array) -> Array:
        """Return h_α without gravity, (..., L) in N·m, at yaw rate ``u2`` (...) in rad/s."""
        u2_squared = np.asarray(u2)[..., None] ** 2
        forward = terms.r_bias - terms.r * u2_squared
        return (
            np.einsum("...ik,...i->...k", terms.jacobian_r, self.masses * forward)
            + np.einsum("...ik,...i->...k", terms.jacobian_z, self.masses * terms.z_bias)
            - 0.5 * self._yaw_inertia_slope(alpha) * u2_squared
        )

    def gravity_torque(self, alpha: Array) -> Array:
        """Return the gravity part of h_α, (..., L) in N·m."""
        return GRAVITY_M_S2 * self.first_moments * np.cos(alpha)

    def mass_matrix(self, alpha: Array, terms: ChainTerms | None = None) -> Array:
        """Return M(α), shape (..., 2 + L, 2 + L), for v = (u1, u2, α̇)."""
        if terms is None:
            terms = self.terms(alpha, np.zeros_like(alpha))
        size = 2 + self.link_count
        matrix = np.zeros((*np.shape(alpha)[:-1], size, size))
        coupling = np.einsum("i,...ik->...k", self.masses, terms.jacobian_r)
        axial_share = self.transverse * np.cos(alpha) ** 2 + self.axial * np.sin(alpha) ** 2
        matrix[..., 0, 0] = self.base_mass + self.masses.sum()
        matrix[..., 0, 2:] = coupling
        matrix[..., 2:, 0] = coupling
        matrix[..., 1, 1] = self.base_yaw_inertia + (self.masses * terms.r**2 + axial_share).sum(-1)
        matrix[..., 2:, 2:] = self.pitch_inertia(terms)
        return matrix

    def bias(self, alpha: Array, velocity: Array, terms: ChainTerms | None = None) -> Array:
        """Return h(α, v) with gravity, shape (..., 2 + L); ``velocity`` is v, (..., 2 + L)."""
        u1, u2, alpha_dot = velocity[..., 0], velocity[..., 1], velocity[..., 2:]
        if terms is None:
            terms = self.terms(alpha, alpha_dot)
        bias = np.empty_like(velocity)
        bias[..., 0] = (self.masses * (terms.r_bias - terms.r * u2[..., None] ** 2)).sum(-1)
        bias[..., 1] = u2 * (
            (self.masses * terms.r * (2 * terms.r_dot + u1[..., None])).sum(-1)
            + (self._yaw_inertia_slope(alpha) * alpha_dot).sum(-1)
        )
        bias[..., 2:] = self.pitch_bias(alpha, terms, u2) + self.gravity_torque(alpha)
        return bias

    def _along(self, values: Array) -> Array:
        return np.einsum("ik,...k->...i", self.geometry, values)

    def _yaw_inertia_slope(self, alpha: Array) -> Array:
        return 2 * (self.axial - self.transverse) * np.sin(alpha) * np.cos(alpha)
