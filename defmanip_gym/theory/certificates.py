"""Bounds on the grasp motion under which ‖z2‖∞ ≤ σ: Eqs. (17), (18) and the exact linear one.

=================  ==================================================================
``tanner``         Eq. (18) with the radical that Eq. (21) implies, √(λ_m/λ_M)
``tanner_printed`` Eq. (18) as printed, √(λ_M/λ_m); for comparison only, not a certificate
``l1``             σ / ∫|C e^{At} B| dt, which no smaller bound on the linear model can beat
=================  ==================================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.params import BeamParams, validated_sigma
from defmanip_gym.theory.chain import Array
from defmanip_gym.theory.impulse_response import peak_free_response, peak_gains
from defmanip_gym.theory.zero_dynamics import (
    LinearizedObject,
    equilibrium,
    is_hurwitz,
    linearize,
    lyapunov_matrix,
)
from defmanip_gym.validation import require_choice, require_instance, require_non_negative


@dataclass(frozen=True, kw_only=True)
class CertificateConditions:
    """What a certificate takes for granted about the motion.

    Attributes:
        vertical_acceleration_m_s2: |vertical grasp acceleration| stays below this.
        yaw_rate_rad_s: |u2| stays below this.
        initial_swing_rad: the beam starts straight and at rest, at most this far off the vertical.
        acceleration_error_m_s2: forward acceleration stays this close to what it was meant to be.
        vertical_error_m_s2: the same for the vertical one.
    """

    vertical_acceleration_m_s2: float = 0.0
    yaw_rate_rad_s: float = 0.0
    initial_swing_rad: float = 0.0
    acceleration_error_m_s2: float = 0.0
    vertical_error_m_s2: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            require_non_negative(name, getattr(self, name))


# Room for the transport task: 0.43 m of lifting, one turn of some 70 degrees, sampled starts, and
# what disturbances do within the control period in which they change.
TRANSPORT_CONDITIONS = CertificateConditions(
    vertical_acceleration_m_s2=0.05,
    yaw_rate_rad_s=0.3,
    initial_swing_rad=0.05,
    acceleration_error_m_s2=0.01,
    vertical_error_m_s2=0.01,
)


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Bounds on the commanded grasp motion that keep ‖z2‖∞ ≤ σ.

    Attributes:
        method: key of the method in this module's table.
        is_proven: whether a proof for the linearized object stands behind it; attacks on the
            nonlinear one are in the tests.
        sigma_rad: σ of Eq. (9).
        beam: the object it was computed for.
        nu_max: the bound on sup‖ν‖∞ before it is shared between speed and acceleration, m/s².
        acceleration_bound: largest commanded forward acceleration, m/s².
        speed_bound: largest grasp speed, m/s; infinite where speed does not deform the object.
        conditions: what it takes for granted, enforced by ``NuMaxActionScaling``.
    """

    method: str
    is_proven: bool
    sigma_rad: float
    beam: BeamParams
    nu_max: float
    acceleration_bound: float
    speed_bound: float
    conditions: CertificateConditions = field(default_factory=CertificateConditions)

    @property
    def vertical_acceleration_bound(self) -> float:
        """Largest commanded vertical acceleration, m/s²."""
        conditions = self.conditions
        return max(conditions.vertical_acceleration_m_s2 - conditions.vertical_error_m_s2, 0.0)


def certify(
    beam: BeamParams,
    *,
    sigma_rad: float = math.pi / 6,
    method: str = "l1",
    conditions: CertificateConditions | None = None,
) -> Certificate:
    """Compute a certificate for a beam.

    Args:
        beam: the object; use the lower end of its damping interval.
        sigma_rad: admissible deformation σ.
        method: ``"l1"``, ``"tanner"`` or ``"tanner_printed"``.
        conditions: what the motion will respect; by default nothing but forward acceleration.

    Raises:
        CertificateError: unknown method, an undamped object, or conditions that leave no room.
        ParameterError: σ out of range.
    """
    require_instance("beam", beam, BeamParams)
    validated_sigma(sigma_rad)
    require_choice("method", method, tuple(_METHODS), CertificateError)
    conditions = conditions or CertificateConditions()
    linear = linearize(beam)
    if not is_hurwitz(linear.A_u):
        raise CertificateError(
            "damping",
            (beam.damping, beam.joint_damping),
            "damping that makes A_u of Eq. (16) Hurwitz",
            "A small periodic motion drives an undamped object to any swing; add damping.",
        )
    certificate = _METHODS[method](beam, linear, sigma_rad, conditions)
    if not certificate.acceleration_bound > 0:
        raise CertificateError(
            "acceleration_bound",
            certificate.acceleration_bound,
            "a bound > 0",
            f"The conditions {conditions} alone use up σ = {sigma_rad:.4g}; ask for less.",
        )
    return certificate


def nu_max_tanner(
    linear: LinearizedObject, deformation_budget_rad: float, *, printed: bool
) -> float:
    """Return ν_max of Eq. (18) in m/s².

    Args:
        linear: the linearization (16).
        deformation_budget_rad: σ − sup‖z2*‖∞.
        printed: with the radical as printed instead of the one that follows from Eq. (21).
    """
    smallest, largest = np.linalg.eigvalsh(lyapunov_matrix(linear.A_u))[[0, -1]]
    radical = math.sqrt(largest / smallest if printed else smallest / largest)
    input_gain = np.linalg.norm(linear.B_u, 2)  # λ_M(B_u) = √λ_max(B_u B_uᵀ)
    return float(deformation_budget_rad / (8 * linear.count**2 * largest * input_gain) * radical)


def stiffness_gain(linear: LinearizedObject, perturbation: Array) -> Array:
    """Return sup|z2_k| per unit of a stiffness perturbation and of ‖z2‖∞ ≤ σ, shape (N,)."""
    C = np.eye(linear.count, 2 * linear.count)
    return peak_gains(linear.A_u, perturbation, C).sum(axis=1)


def _tanner(
    beam: BeamParams,
    linear: LinearizedObject,
    sigma_rad: float,
    conditions: CertificateConditions,
    *,
    printed: bool = False,
) -> Certificate:
    smallest, largest = np.linalg.eigvalsh(lyapunov_matrix(linear.A_u))[[0, -1]]
    start = conditions.initial_swing_rad * math.sqrt(linear.count * largest / smallest)
    # Eq. (16) is the motion without yaw; small gain adds what the centrifugal stiffness brings
    turning = conditions.yaw_rate_rad_s**2 * stiffness_gain(linear, linear.centrifugal_stiffness)
    rest = float(np.abs(equilibrium(beam)).max())
    budget = sigma_rad * float(1.0 - turning.max()) - rest - start
    nu_max = nu_max_tanner(linear, budget, printed=printed)
    # Eq. (19) with s = sup‖ż1‖∞ = ν_max / 2, the paper's choice in Section VI
    half = max(nu_max, 0.0) / 2
    return Certificate(
        method="tanner_printed" if printed else "tanner",
        is_proven=not printed,
        sigma_rad=sigma_rad,
        beam=beam,
        nu_max=nu_max,
        acceleration_bound=half,
        speed_bound=half,
        conditions=CertificateConditions(
            vertical_acceleration_m_s2=half,
            yaw_rate_rad_s=conditions.yaw_rate_rad_s,
            initial_swing_rad=conditions.initial_swing_rad,
        ),
    )


def _tanner_printed(
    beam: BeamParams,
    linear: LinearizedObject,
    sigma_rad: float,
    conditions: CertificateConditions,
) -> Certificate:
    return _tanner(beam, linear, sigma_rad, conditions, printed=True)


def _l1(
    beam: BeamParams,
    linear: LinearizedObject,
    sigma_rad: float,
    conditions: CertificateConditions,
) -> Certificate:
    """Exact peak gain; vertical acceleration and yaw enter as bounded stiffness perturbations.

    With |φ_k| ≤ σ they act like inputs of known size (small gain), whatever their time course.
    """
    count = linear.count
    C = np.eye(count, 2 * count)
    inputs = np.hstack(
        (linear.forward_input[:, None], linear.vertical_stiffness, linear.centrifugal_stiffness)
    )
    gains = peak_gains(linear.A_u, inputs, C)
    forward = gains[:, 0]
    vertical = gains[:, 1 : 1 + count].sum(axis=1)
    centrifugal = gains[:, 1 + count :].sum(axis=1)
    budget = sigma_rad * (
        1.0
        - conditions.vertical_acceleration_m_s2 * vertical
        - conditions.yaw_rate_rad_s**2 * centrifugal
    )
    if conditions.initial_swing_rad > 0:
        start = np.concatenate((np.full(count, conditions.initial_swing_rad), np.zeros(count)))
        budget = budget - peak_free_response(linear.A_u, start, C)
    nu_max = float((budget / forward).min())
    return Certificate(
        method="l1",
        is_proven=True,
        sigma_rad=sigma_rad,
        beam=beam,
        nu_max=nu_max,
        acceleration_bound=nu_max - conditions.acceleration_error_m_s2,
        speed_bound=math.inf,
        conditions=conditions,
    )


_METHODS: dict[
    str,
    Callable[[BeamParams, LinearizedObject, float, CertificateConditions], Certificate],
] = {"tanner": _tanner, "tanner_printed": _tanner_printed, "l1": _l1}

CERTIFICATE_METHODS = tuple(_METHODS)
