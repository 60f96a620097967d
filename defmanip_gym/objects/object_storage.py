"""Lemma III.1's V as a barrier for objects from model files, swinging in any direction.

As ``theory.filters.storage`` for rods, with MuJoCo's mass matrix and potential in the place of
formulas: B = ½ ż2ᵀ m_o22 ż2 + U + ½ u2² (I_σ − I_z) has

    Ḃ = −ż2ᵀ d_o22 ż2 − sᵀ z̈1 + u̇2 (u2 (I_σ − I_z) − m_yᵀ ż2),   s = m_o12ᵀ ż2,

with m_y the coupling of yaw and z2, zero for what swings in the vertical plane of the heading. The
grasp that neither accelerates nor turns faster never feeds it, damping or not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from defmanip_gym.errors import CertificateError
from defmanip_gym.objects.internal_forces import CARRIAGE, YAW, InternalForces
from defmanip_gym.objects.mjcf_object import MjcfObject
from defmanip_gym.params import GRAVITY_M_S2, validated_sigma
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_array, require_between, require_positive

_STARTS = 8  # of the search on each face, at random
_SPARE = 0.01  # of V_σ, for the second order in the period


@dataclass(frozen=True, kw_only=True)
class Stored:
    """What an object stores in a state.

    Attributes:
        energy_j: B.
        momentum: s = m_o12ᵀ ż2, (3,) kg·m/s: forward, left, up.
        turning: what u̇2 multiplies in Ḃ, J·s.
    """

    energy_j: float
    momentum: Array
    turning: float


class ObjectStorage:
    """The storage of an object from a model file, its lowest pass out of σ, and the filter on it.

    Args:
        deformable: the object; its coordinates are the file's joint positions.
        sigma_rad: σ, for each of them.
        max_acceleration_m_s2: of the grasp, on each axis.
        period_s: for which accelerations hold.

    Attributes:
        pass_j: V_σ, J above the equilibrium: the smallest U that a search on ‖z2‖∞ = σ found.
        segment: name of the coordinate that is at σ there.
        level_j: up to which B may rise.

    Raises:
        CertificateError: U does not rise towards σ, or the period is too long for it.
    """

    def __init__(
        self,
        deformable: MjcfObject,
        *,
        sigma_rad: float = math.pi / 6,
        max_acceleration_m_s2: float = 3.0,
        period_s: float = 0.02,
    ) -> None:
        self.sigma_rad = validated_sigma(sigma_rad)
        self._largest = require_positive("max_acceleration_m_s2", max_acceleration_m_s2, "m/s²")
        self._period = require_between("period_s", period_s, 0.0, 1.0)
        self._forces = InternalForces(deformable.object_file)
        self._equilibrium = deformable.linear.equilibrium
        self.count = deformable.linear.count
        self._lowest = self._forces.potential(self._equilibrium)
        self._mass = float(deformable.linear.m_o11[0, 0])
        coordinate, self.pass_j, self._yaw_inertia = self._boundary()
        self.coordinate = deformable.linear.coordinates[coordinate]
        pull = GRAVITY_M_S2 * math.sin(self.sigma_rad) + self._largest
        between = self._period**2 / 8 * self._mass * pull * math.sqrt(3.0) * self._largest
        self.level_j = (1 - _SPARE) * self.pass_j - between
        if not self.level_j > 0:
            raise CertificateError(
                "V_σ of the object",
                self.pass_j,
                f"more than {between:.3g} J, what a period of {self._period:g} s may bring",
                "Use a larger sigma_rad, a shorter period or smaller accelerations.",
            )

    def stored(self, z2: Array, z2_rate: Array, yaw_rate_rad_s: float = 0.0) -> Stored:
        """Return what is stored.

        Args:
            z2: the file's joint positions, (N,).
            z2_rate: their rates, (N,).
            yaw_rate_rad_s: u2.

        Raises:
            ParameterError: states of another size.
        """
        z2 = require_array("z2", z2, (self.count,))
        rate = require_array("z2_rate", z2_rate, (self.count,))
        matrix = self._forces.mass_matrix(z2)
        inner = slice(CARRIAGE, None)
        spare_inertia = self._yaw_inertia - matrix[YAW, YAW]
        energy = 0.5 * rate @ matrix[inner, inner] @ rate + 0.5 * yaw_rate_rad_s**2 * spare_inertia
        return Stored(
            energy_j=float(energy + self._forces.potential(z2) - self._lowest),
            momentum=matrix[:3, inner] @ rate,
            turning=float(yaw_rate_rad_s * spare_inertia - matrix[YAW, inner] @ rate),
        )

    def allowed(
        self, wished_m_s2: Array, z2: Array, z2_rate: Array, yaw_rate_rad_s: float = 0.0
    ) -> Array:
        """Return the grasp acceleration nearest to the wished one, (3,) m/s², that may hold now.

        While the yaw rate is held, B stays below its level in the period; the second order in the
        period is bounded by the object's mass.

        Args:
            wished_m_s2: forward, left, up, (3,).
            z2: the file's joint positions, (N,).
            z2_rate: their rates, (N,).
            yaw_rate_rad_s: u2.
        """
        wished = require_array("wished_m_s2", wished_m_s2, (3,))
        wished = np.clip(wished, -self._largest, self._largest)
        T = self._period
        # half a period ahead the power is nearer to that of the whole
        middle = z2 + 0.5 * T * np.asarray(z2_rate)
        force = self._forces(middle, z2_rate, yaw_rate_rad_s=yaw_rate_rad_s)
        matrix = self._forces.mass_matrix(middle)
        inner = slice(CARRIAGE, None)
        rate = z2_rate - 0.5 * T * np.linalg.solve(matrix[inner, inner], force)
        momentum = matrix[:3, inner] @ rate
        left = self.level_j - self.stored(z2, z2_rate, yaw_rate_rad_s).energy_j
        # −T s·a + ½ T² m a² ≤ left, whose second part the coasting grasp does not need
        second = 0.5 * T**2 * self._mass
        square = float(momentum @ momentum)
        accelerations = wished
        if square > 0:
            short = float(-T * momentum @ wished + second * wished @ wished) - left
            accelerations = wished + max(short, 0.0) / (T * square) * momentum
        accelerations = np.clip(accelerations, -self._largest, self._largest)
        return _share(accelerations, momentum * T, second, left) * accelerations

    def _boundary(self) -> tuple[int, float, float]:
        """Return coordinate and height of the lowest pass, J, and I_σ, kg·m²."""
        rng, sigma = np.random.default_rng(0), self.sigma_rad

        def energy(z2: Array) -> tuple[float, Array]:
            return self._forces.potential(z2) - self._lowest, self._forces(z2)

        lowest, where, inertia = math.inf, 0, 0.0
        for face in range(self.count):
            for side in (-sigma, sigma):
                bounds = [(-sigma, sigma)] * self.count
                bounds[face] = (side, side)
                starts = rng.uniform(-sigma, sigma, (_STARTS, self.count))
                starts[0] = np.clip(self._equilibrium, -sigma, sigma)
                starts[:, face] = side
                for start in starts:
                    inertia = max(inertia, float(self._forces.mass_matrix(start)[YAW, YAW]))
                    found = minimize(energy, start, jac=True, bounds=bounds, method="L-BFGS-B")
                    if found.fun < lowest:
                        lowest, where = float(found.fun), face
        corners = rng.choice((-sigma, sigma), (64, self.count))
        corners[:2] = [[-sigma], [sigma]]
        inertia = max(
            inertia, *(float(self._forces.mass_matrix(corner)[YAW, YAW]) for corner in corners)
        )
        if not lowest > 0:
            raise CertificateError(
                "V_σ of the object",
                lowest,
                "an energy above that of the equilibrium",
                "There is no pass within σ: use another sigma_rad, or stiffer joints.",
            )
        return where, lowest, inertia


def _share(accelerations: Array, slope: Array, second: float, left: float) -> float:
    """Return the largest part in [0, 1] of accelerations with −slope·a + second a² ≤ left."""
    a = second * float(accelerations @ accelerations)
    b = -float(slope @ accelerations)
    if a + b <= left or a == 0.0:
        return 1.0
    if left <= 0.0:  # from outside: down as far as it goes
        return min(max(-b / (2 * a), 0.0), 1.0)
    return min((math.sqrt(b**2 + 4 * a * left) - b) / (2 * a), 1.0)
