"""What a sampled robot's errors cost of a certificate's room.

A certificate bounds the acceleration that the object meets; a wrapper chooses the one that is asked
for. Between the two lie errors of the inner loop: of the mean over a control period, and of the
course within it. This module says how much room they need, all as forward acceleration
(docs/derivations.md, section 5).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.conditions import EXACT_PARAMETERS
from defmanip_gym.theory.certificates.impulse_response import peak_gains
from defmanip_gym.theory.certificates.limits import nonlinear_limit
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, linearize

# ω h beyond which an integration step of the plant is no longer small against its swing
_LONGEST_STEP_RAD = 0.3


@dataclass(frozen=True, kw_only=True)
class ErrorBudget:
    """A certificate's room for errors, and what errors use of it.

    Attributes:
        room_m_s2: forward acceleration that may be lost to errors.
        vertical_room_m_s2: vertical acceleration that may be, at no further cost.
        vertical_rate: forward acceleration that does as much as 1 m/s² of vertical one, at σ.
        stray_rate_per_s: and as much as 1 m/s of velocity beside the straight line between samples.
        integration_m_s2: what the plant's integration step costs.
    """

    room_m_s2: float
    vertical_room_m_s2: float
    vertical_rate: float
    stray_rate_per_s: float
    integration_m_s2: float

    @classmethod
    def of(
        cls, certificate: Certificate, beams: Iterable[BeamParams], *, physics_period_s: float
    ) -> ErrorBudget:
        """Return the budget of a certificate.

        Args:
            certificate: that is enforced.
            beams: that may be carried.
            physics_period_s: integration step of the plant.
        """
        linear = _weakest(certificate)
        step_rad = _fastest_swing_rad_s(linear) * physics_period_s
        integration = step_rad**2 / 8 * certificate.resulting_acceleration
        return cls(
            room_m_s2=_room(certificate, beams),
            vertical_room_m_s2=certificate.conditions.vertical_error_m_s2,
            vertical_rate=math.tan(certificate.sigma_rad),
            stray_rate_per_s=_stray_rate(linear),
            integration_m_s2=integration if step_rad < _LONGEST_STEP_RAD else math.inf,
        )

    def needed(
        self, forward_m_s2: Array | float, vertical_m_s2: Array | float, stray_m_s: Array | float
    ) -> Array:
        """Return the room that errors of these sizes need, (...) m/s².

        Args:
            forward_m_s2: of the period's mean forward acceleration, (...).
            vertical_m_s2: of its vertical one, (...).
            stray_m_s: distance of the grasp velocity from the straight line between samples, (...).
        """
        lifted = np.maximum(vertical_m_s2 - self.vertical_room_m_s2, 0.0)
        needed: Array = (
            forward_m_s2
            + self.vertical_rate * lifted
            + self.stray_rate_per_s * stray_m_s
            + self.integration_m_s2
        )
        return needed


def _weakest(certificate: Certificate) -> LinearizedObject:
    """Return the certified object with the least damping of its interval."""
    deformable = certificate.deformable
    linear = linearize(deformable) if isinstance(deformable, BeamParams) else deformable
    return linear.scaled(damping=certificate.intervals.damping[0])


def _room(certificate: Certificate, beams: Iterable[BeamParams]) -> float:
    """Return what the conditions leave, or the way to the limits of the nonlinear beams."""
    limits = [
        nonlinear_limit(beam, certificate.sigma_rad, certificate.conditions, EXACT_PARAMETERS)
        for beam in beams
    ]
    room = certificate.conditions.acceleration_error_m_s2
    return max(room, min(limits) - certificate.acceleration_bound)


def _stray_rate(linear: LinearizedObject) -> float:
    """Return the exchange rate of velocity and acceleration, 1/s.

    With η = η_s + b v the object sees A b v in the place of b v̇, so that a bounded v costs what its
    peak gain does.
    """
    b = linear.forward_input[:, None]
    C = np.eye(2 * linear.count)[: linear.count]
    by_acceleration = peak_gains(linear.A_u, b, C)[:, 0]
    by_velocity = peak_gains(linear.A_u, linear.A_u @ b, C)[:, 0]
    moved = by_acceleration > 1e-9 * by_acceleration.max()
    return float((by_velocity[moved] / by_acceleration[moved]).max())


def _fastest_swing_rad_s(linear: LinearizedObject) -> float:
    """Return the fastest swing that gravity makes; springs are integrated implicitly."""
    squares = np.linalg.eigvals(np.linalg.solve(linear.m_o22, linear.gravity_stiffness))
    return math.sqrt(float(np.abs(squares).max()))
