"""The exact limit of a nonlinear one-hinge beam, from its extremal swing.

In the phase plane nothing crosses from below the trajectory on which every input pushes outward as
hard as it may, point by point. Followed back from rest at +σ, that curve V(φ) either reaches −σ,
and then −V(−φ) ≤ φ̇ ≤ V(φ) is a set which nothing leaves, the largest one within |φ| ≤ σ; or it
comes to rest before, and then an input exists that leaves. A proof for the nonlinear object, with
lifting, turning and parameters that may even vary in time (docs/derivations.md, section 5).
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.certificates.conditions import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.dynamics.chain import Array, beam_links

_LARGEST_ACCELERATION_M_S2 = 100.0
_ROUNDED_DOWN = 1 - 2e-5  # more than the errors of integration and root finding
_RESOLUTION = 1e-9


def one_hinge_stays(
    beam: BeamParams,
    acceleration_m_s2: float,
    sigma_rad: float,
    conditions: CertificateConditions,
    box: ParameterIntervals,
) -> bool:
    """Whether |φ| ≤ σ under every forward acceleration up to a bound; see ``one_hinge_limit``."""
    return _Adversary(beam, acceleration_m_s2, conditions, box).is_contained(sigma_rad)


def one_hinge_limit(
    beam: BeamParams,
    sigma_rad: float,
    conditions: CertificateConditions,
    box: ParameterIntervals,
) -> float:
    """Return the largest forward acceleration bound (m/s²) that keeps |φ| ≤ σ; 0 if there is none.

    Args:
        beam: one segment; friction, spring and gravity act as in Eq. (6b), not linearized.
        sigma_rad: σ, below π/2.
        conditions: limits of lifting and turning, and of the initial state.
        box: factors on the root's damping and stiffness.
    """

    def stays(acceleration: float) -> bool:
        return one_hinge_stays(beam, acceleration, sigma_rad, conditions, box)

    if not stays(0.0):
        return 0.0
    if stays(_LARGEST_ACCELERATION_M_S2):
        return _LARGEST_ACCELERATION_M_S2
    limit = brentq(
        lambda acceleration: 0.5 - stays(acceleration),
        0.0,
        _LARGEST_ACCELERATION_M_S2,
        xtol=_RESOLUTION,
        rtol=1e-6,
    )
    return max(float(limit * _ROUNDED_DOWN - 2 * _RESOLUTION), 0.0)


def one_hinge_reachable_set(
    beam: BeamParams,
    acceleration_m_s2: float,
    sigma_rad: float,
    conditions: CertificateConditions,
    box: ParameterIntervals,
) -> tuple[Array, Array] | None:
    """Return the edge of what the inputs can reach from the allowed starts, None if not within ±σ.

    The edge is the half swing on which every input pushes outward and which ends as far out as it
    began: after many of them the inputs reach no farther. Its mirror image −φ̇(−φ) is the other
    half; between the two lies every motion.

    Args:
        beam: one segment.
        acceleration_m_s2: bound on the forward acceleration.
        sigma_rad: σ.
        conditions: limits of lifting and turning, and of the initial state.
        box: factors on the root's damping and stiffness.

    Returns:
        Angles, rad, and rates ≥ 0, rad/s, from left to right.
    """
    adversary = _Adversary(beam, acceleration_m_s2, conditions, box)
    if not adversary.is_contained(sigma_rad):
        return None
    first = max(conditions.initial_swing_rad, _RESOLUTION)
    begin = max(
        float(adversary.half_swing(start, conditions.initial_swing_rate_rad_s)[0, -1])
        for start in np.linspace(-first, first, 5)
    )

    def growth(amplitude: float) -> float:
        return float(adversary.half_swing(-amplitude, 0.0)[0, -1]) - amplitude

    begin = max(begin, first)
    amplitude = begin
    if begin < sigma_rad and growth(begin) > 0:
        # at the exact limit σ itself is the amplitude, up to rounding
        amplitude = sigma_rad if growth(sigma_rad) > 0 else brentq(growth, begin, sigma_rad)
    angles, rates = adversary.half_swing(-amplitude, 0.0)
    return angles, np.maximum(rates, 0.0)


class _Adversary:
    """φ̈ with every input chosen outward (positive), for one bound on the acceleration."""

    def __init__(
        self,
        beam: BeamParams,
        acceleration: float,
        conditions: CertificateConditions,
        box: ParameterIntervals,
    ) -> None:
        (rod,) = beam_links(beam)
        self.moment = rod.mass_kg * rod.com_m
        self.inertia = rod.mass_kg * rod.com_m**2 + rod.transverse_inertia_kgm2
        self.centrifugal = (self.inertia - rod.axial_inertia_kgm2) * conditions.yaw_rate_rad_s**2
        self.damping = beam.damping * box.damping[0]
        self.softest, self.stiffest = (beam.root_stiffness * factor for factor in box.stiffness)
        self.acceleration, self.conditions = acceleration, conditions

    def outward_acceleration(self, phi: float, rate: float) -> float:
        """Return the largest φ̈ at (φ, φ̇ ≥ 0) that the inputs allow."""
        sin, cos = np.sin(phi), np.cos(phi)
        lifting = self.conditions.vertical_acceleration_m_s2 * abs(sin)
        torque = self.moment * (self.acceleration * cos + lifting - GRAVITY_M_S2 * sin)
        torque += max(self.centrifugal * sin * cos, 0.0)
        torque -= (self.stiffest if phi < 0 else self.softest) * phi + self.damping * rate
        return float(torque / self.inertia)

    def is_contained(self, sigma: float) -> bool:
        """Whether the set below the curve spans [−σ, σ] and holds every initial state."""
        if self.outward_acceleration(sigma, 0.0) >= 0:
            return False  # at rest at σ the inputs push farther out

        def backwards(_: float, state: np.ndarray) -> tuple[float, float]:
            return -state[1], -self.outward_acceleration(state[0], state[1])

        def far_beyond(_: float, state: np.ndarray) -> float:
            return float(state[0]) + 1.5 * sigma

        far_beyond.terminal = True  # type: ignore[attr-defined]
        curve = solve_ivp(
            backwards,
            (0.0, self._longest_half_swing()),
            (sigma, 0.0),
            method="LSODA",
            events=(far_beyond, _comes_to_rest),
            rtol=1e-10,
            atol=1e-12,
        )
        if curve.y[0, -1] > -sigma:
            return False
        angles, rates = curve.y[:, ::-1]
        conditions = self.conditions
        starts = np.linspace(-conditions.initial_swing_rad, conditions.initial_swing_rad, 41)
        allowed = np.interp(starts, angles, rates).min()
        return bool(
            conditions.initial_swing_rad <= sigma and conditions.initial_swing_rate_rad_s <= allowed
        )

    def half_swing(self, phi: float, rate: float) -> Array:
        """Return angles and rates, (2, T), from a state with φ̇ ≥ 0 until rest, all pushing out."""

        def forwards(_: float, state: np.ndarray) -> tuple[float, float]:
            return state[1], self.outward_acceleration(state[0], state[1])

        curve = solve_ivp(
            forwards,
            (0.0, self._longest_half_swing()),
            (phi, max(rate, _RESOLUTION)),
            method="LSODA",
            events=_comes_to_rest,
            rtol=1e-9,
            atol=1e-11,
        )
        return np.asarray(curve.y)

    def _longest_half_swing(self) -> float:
        """Return a time, s, in which the curve reaches −σ or comes to rest."""
        return float(100 * np.sqrt(self.inertia / (self.moment * GRAVITY_M_S2)))


def _comes_to_rest(_: float, state: np.ndarray) -> float:
    return float(state[1])


_comes_to_rest.terminal, _comes_to_rest.direction = True, -1  # type: ignore[attr-defined]
