"""Bounds on the grasp motion under which ‖z2‖∞ ≤ σ: a ladder from Eq. (18) to the exact one.

=================  ==================================================================
``tanner_printed`` Eq. (18) as printed, √(λ_M/λ_m); for comparison only, not a certificate
``tanner``         Eq. (18) with the radical that Eq. (21) implies, √(λ_m/λ_M)
``lyapunov``       the same P without the slack of norm conversions
``ellipsoid``      the best invariant ellipsoid
``l1``             σ / ∫|C e^{At} B| dt, the largest bound that the linear model allows
``phase_plane``    for one hinge: the largest bound that the nonlinear object allows
=================  ==================================================================

Every rung treats lifting, turning, initial states and intervals of parameters the same way
(``small_gain``, ``worst_case``) and says how much of it is proven for the nonlinear object.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TypeGuard

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, validated_sigma
from defmanip_gym.theory.certificates.certificate import Certificate, Deformable
from defmanip_gym.theory.certificates.conditions import (
    EXACT_PARAMETERS,
    CertificateConditions,
    ParameterIntervals,
)
from defmanip_gym.theory.certificates.limits import (
    CERTIFICATE_METHODS,
    PHASE_PLANE,
    SHARED_WITH_SPEED,
    linear_limit,
    nonlinear_limit,
)
from defmanip_gym.theory.certificates.phase_plane import one_hinge_stays
from defmanip_gym.theory.certificates.worst_case import WorstCase
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, linearize
from defmanip_gym.validation import require_choice, require_instance

_NEGLIGIBLE_TORQUE, _NEGLIGIBLE_INPUT = 1e-6, 1e-9
_LEAST_DAMPING_RATIO = 2e-5  # integrals over a response take as long as it does


def certify(
    deformable: Deformable,
    *,
    sigma_rad: float = math.pi / 6,
    method: str = "l1",
    conditions: CertificateConditions | None = None,
    intervals: ParameterIntervals | None = None,
) -> Certificate:
    """Compute a certificate for an object.

    Args:
        deformable: a beam, or the linearization of any object.
        sigma_rad: admissible deformation σ; in m for coordinates that are slides.
        method: one of ``CERTIFICATE_METHODS``.
        conditions: what the motion will respect; by default nothing but forward acceleration.
            Under the paper's own methods lifting shares ν_max and errors are not provided for.
        intervals: factors on damping and stiffness; by default the object's values are exact.

    Raises:
        CertificateError: unknown method, an undamped object, or conditions that leave no room.
        ParameterError: σ out of range.
    """
    if not isinstance(deformable, LinearizedObject):
        require_instance("beam", deformable, BeamParams)
    sigma_rad = validated_sigma(sigma_rad)
    require_choice("method", method, CERTIFICATE_METHODS, CertificateError)
    conditions = CertificateConditions() if conditions is None else conditions
    intervals = EXACT_PARAMETERS if intervals is None else intervals
    require_instance("conditions", conditions, CertificateConditions)
    require_instance("intervals", intervals, ParameterIntervals)
    linear = linearize(deformable) if isinstance(deformable, BeamParams) else deformable
    _require_damping(linear, intervals)
    _require_an_input(linear)
    _require_yaw_is_allowed(linear, conditions)
    _require_unloaded_springs(linear, intervals)
    if method == PHASE_PLANE:
        worst = _phase_plane(deformable, sigma_rad, conditions, intervals)
    else:
        worst = linear_limit(linear, sigma_rad, method, conditions, intervals)
        # the nonlinear limit is exact for one hinge of known stiffness: claim nothing beyond it
        is_known = np.ptp(intervals.stiffness) == 0 and method != "tanner_printed"
        if is_known and _is_one_hinge(deformable):
            worst = _within_the_nonlinear_limit(worst, deformable, sigma_rad, conditions, intervals)
    certificate = Certificate(
        method=method,
        sigma_rad=sigma_rad,
        deformable=deformable,
        nu_max=worst.bound,
        acceleration_bound=worst.bound - conditions.acceleration_error_m_s2,
        speed_bound=math.inf,
        conditions=conditions,
        intervals=intervals,
        worst_factors=(worst.damping, worst.stiffness),
    )
    if method in SHARED_WITH_SPEED:
        certificate = _shared_with_speed(certificate)
    if worst.bound == 0 and intervals != EXACT_PARAMETERS:
        raise CertificateError(
            "intervals",
            intervals,
            "intervals over which a bound can be guaranteed",
            "Narrow them, or ask for less in the conditions.",
        )
    if not certificate.acceleration_bound > 0:
        raise CertificateError(
            "acceleration_bound",
            certificate.acceleration_bound,
            "a bound > 0",
            f"The conditions {conditions} alone use up σ = {sigma_rad:.4g}; ask for less.",
        )
    return certificate


def _is_one_hinge(deformable: Deformable) -> TypeGuard[BeamParams]:
    return isinstance(deformable, BeamParams) and deformable.segment_count == 1


def _within_the_nonlinear_limit(
    worst: WorstCase,
    beam: BeamParams,
    sigma_rad: float,
    conditions: CertificateConditions,
    intervals: ParameterIntervals,
) -> WorstCase:
    """Lower a linear bound where it exceeds what the nonlinear hinge allows, which is exact."""
    if one_hinge_stays(beam, worst.bound, sigma_rad, conditions, intervals):
        return worst
    limit = nonlinear_limit(beam, sigma_rad, conditions, intervals)
    return replace(worst, bound=min(worst.bound, limit))


def _phase_plane(
    deformable: Deformable,
    sigma_rad: float,
    conditions: CertificateConditions,
    intervals: ParameterIntervals,
) -> WorstCase:
    if not _is_one_hinge(deformable):
        is_beam = isinstance(deformable, BeamParams)
        raise CertificateError(
            "method",
            PHASE_PLANE,
            "an object with one hinge: BeamParams(segment_count=1)",
            'Use method="l1" for objects with more coordinates.'
            if is_beam
            else "It follows the nonlinear object, and of this one only the linearization is "
            'known: use method="l1", or describe the object as a beam.',
        )
    return WorstCase(
        bound=nonlinear_limit(deformable, sigma_rad, conditions, intervals),
        damping=intervals.damping[0],
        stiffness=intervals.stiffness[0],
    )


def _shared_with_speed(certificate: Certificate) -> Certificate:
    """Split ν_max by Eq. (19) with s = sup‖ż1‖∞ = ν_max / 2, the paper's choice in Section VI.

    ν counts lifting too. What lifting does to the stiffness, which B_u does not know, is covered by
    the slack: this bound is 4 N² times smaller than ``lyapunov``.
    """
    half = certificate.nu_max / 2
    conditions = replace(
        certificate.conditions,
        vertical_acceleration_m_s2=half,
        acceleration_error_m_s2=0.0,
        vertical_error_m_s2=0.0,
    )
    return replace(certificate, acceleration_bound=half, speed_bound=half, conditions=conditions)


def _require_damping(linear: LinearizedObject, intervals: ParameterIntervals) -> None:
    weakest = linear.scaled(damping=intervals.damping[0], stiffness=intervals.stiffness[0])
    eigenvalues = np.linalg.eigvals(weakest.A_u)
    if (-eigenvalues.real / np.abs(eigenvalues)).min() < _LEAST_DAMPING_RATIO:
        raise CertificateError(
            "damping",
            weakest.d_o22.tolist(),
            "damping that makes A_u of Eq. (16) Hurwitz, with damping ratios of at least "
            f"{_LEAST_DAMPING_RATIO:g}",
            "A small periodic motion drives an undamped object to any swing; add damping.",
        )


def _require_an_input(linear: LinearizedObject) -> None:
    if np.abs(linear.B_u[:, 6:8]).max() < _NEGLIGIBLE_INPUT:
        raise CertificateError(
            "deformable",
            linear.coordinates,
            "an object that horizontal acceleration deforms",
            "No bound on the acceleration is needed for this one.",
        )


def _require_yaw_is_allowed(linear: LinearizedObject, conditions: CertificateConditions) -> None:
    if linear.is_excited_by_yaw and conditions.yaw_rate_rad_s > 0:
        raise CertificateError(
            "yaw_rate_rad_s",
            conditions.yaw_rate_rad_s,
            "0 for an object that turning itself deforms",
            "Carry it without turning, or hold it so that it hangs in the plane of motion.",
        )


def _require_unloaded_springs(linear: LinearizedObject, intervals: ParameterIntervals) -> None:
    """Raise where another stiffness would move the equilibrium: gravity then loads the springs."""
    weight = np.abs(linear.m_o12[2]).max() * GRAVITY_M_S2
    if intervals.stiffness != EXACT_PARAMETERS.stiffness and weight > _NEGLIGIBLE_TORQUE:
        raise CertificateError(
            "intervals.stiffness",
            intervals.stiffness,
            "(1.0, 1.0) for an object whose springs carry its weight",
            "Certify it at each end of the interval, or hold it so that it hangs straight.",
        )
