"""Undamped objects: the feedback ν = Hη below Lemma III.2, and what Proposition III.3 needs of it.

Where A_u is not Hurwitz the paper designs H with ‖Hη‖ ≤ μ, and then treats the difference between
Hη and the ν that the robot applies as a disturbance (24)–(26). That cannot keep ‖z2‖∞ ≤ σ for any
s > 0: the motion obeys A_u, whatever H on paper, and an arbitrarily small u_o at resonance drives
an undamped object anywhere. In numbers: g_H = ∫|H e^{(A_u + B_u H)t} b| dt ≥ 1, so the largest
|Hη| that disturbances of size ν_max cause is at least ν_max, and (19) leaves nothing.

Here Hη is applied: u_o = Hη + L ė_z1. Then A_u + B_u H is the true matrix, |L ė_z1| ≤ s the true
disturbance, and the exact peak gains say how large s may be. Proofs: docs/derivations.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property

import control
import numpy as np
from scipy.optimize import brentq

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import validated_sigma
from defmanip_gym.theory.certificates.impulse_response import peak_gains
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.controllability import is_controllable
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject
from defmanip_gym.validation import require_positive

# ε is searched around (μ/σ)², where |Hη| is of the order of μ for |z2| of the order of σ.
_MOST_DECADES = 4
_PRECISION_DECADES = 0.005
_BISECTIONS = 36


@dataclass(frozen=True, kw_only=True)
class InternalFeedback:
    """A feedback u_o = Hη + v of the object's own state, and the inputs |v| ≤ s that it allows.

    From rest, and as long as the linearization (16) holds, every v within the bound keeps both
    ‖z2‖∞ ≤ σ and |Hη| ≤ μ, so a saturation at μ never acts.

    Attributes:
        linear: the object.
        epsilon: ε of the Riccati equation that gave H.
        H: (2N,), forward acceleration per η, 1/s² and 1/s.
        sigma_rad: σ.
        mu: μ, bound on |Hη|, m/s².
        swing_gain: g_φ, largest |z2_k| per m/s² of v.
        feedback_gain: g_H, largest |Hη| per m/s² of v.
    """

    linear: LinearizedObject
    epsilon: float
    H: Array
    sigma_rad: float
    mu: float
    swing_gain: float
    feedback_gain: float

    @property
    def acceleration_bound(self) -> float:
        """The bound s on |v| = |L ė_z1|, m/s²: min((σ − sup‖z2*‖∞) / g_φ, μ / g_H)."""
        budget = self.sigma_rad - float(np.abs(self.linear.equilibrium).max())
        return min(budget / self.swing_gain, self.mu / self.feedback_gain)

    @property
    def total_acceleration(self) -> float:
        """Bound on |u_o| = |Hη + v|, m/s²; at most s + μ."""
        return self.acceleration_bound * (1 + self.feedback_gain)

    @cached_property
    def matrix(self) -> Array:
        """A_u + B_u H, (2N, 2N), the true matrix of η once Hη is applied."""
        return self.linear.A_u + np.outer(self.linear.forward_input, self.H)

    def acceleration(self, eta: Array) -> Array:
        """Return Hη, (...) m/s², for η = (z2 − z2*, ż2), (..., 2N)."""
        return eta @ self.H

    def tracking_matrix(self, gain: float) -> Array:
        """Return the matrix of (ė_z1, η), (1 + 2N, 1 + 2N), under v = −gain · ė_z1.

        Hη moves the grasp too, so tracking and object are one loop; unsaturated.
        """
        size = 1 + len(self.H)
        matrix = np.zeros((size, size))
        matrix[0, 0], matrix[0, 1:] = -gain, self.H
        matrix[1:, 0], matrix[1:, 1:] = -gain * self.linear.forward_input, self.matrix
        return matrix


def stabilizing_feedback(linear: LinearizedObject, epsilon: float) -> Array:
    """Return H = −bᵀP(ε), (2N,), with A_uᵀP + P A_u − P b bᵀ P + ε I = 0, b the forward column.

    A_u + b H is Hurwitz, and where A_u has no eigenvalue in the open right half plane
    (Lemma III.2) H → 0 as ε → 0.

    Raises:
        ParameterError: ε is not positive, or forward acceleration does not reach every mode.
    """
    epsilon = require_positive("epsilon", epsilon)
    if not is_controllable(linear.A_u, linear.forward_input[:, None]):
        raise ParameterError(
            "object",
            linear.coordinates,
            "an object of which forward acceleration reaches every mode",
            "No such feedback can damp a mode that it does not reach; damp the object itself.",
        )
    return _riccati_feedback(linear, epsilon)


def largest_feedback(H: Array, extent: Array) -> float:
    """Return max |Hη|, m/s², over the box |η_j| ≤ extent_j, (2N,)."""
    return float(np.abs(H) @ extent)


def largest_epsilon(linear: LinearizedObject, mu: float, extent: Array) -> float:
    """Return the largest ε whose H keeps |Hη| ≤ μ on the box |η_j| ≤ extent_j.

    Args:
        linear: the object.
        mu: μ, m/s².
        extent: half-widths of the box, (2N,), above 0.
    """
    mu = require_positive("mu", mu, "m/s²")
    low, high = -12.0, 5.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        feedback = largest_feedback(_riccati_feedback(linear, 10.0**middle), extent)
        low, high = (middle, high) if feedback <= mu else (low, middle)
    return 10.0**low


def internal_feedback(
    linear: LinearizedObject, sigma_rad: float, mu: float, epsilon: float
) -> InternalFeedback:
    """Return the feedback for one ε with its exact peak gains."""
    H = stabilizing_feedback(linear, epsilon)
    b = linear.forward_input
    outputs = np.vstack((np.eye(linear.count, 2 * linear.count), H))
    gains = peak_gains(linear.A_u + np.outer(b, H), b[:, None], outputs)[:, 0]
    return InternalFeedback(
        linear=linear,
        epsilon=epsilon,
        H=H,
        sigma_rad=sigma_rad,
        mu=mu,
        swing_gain=float(gains[:-1].max()),
        feedback_gain=float(gains[-1]),
    )


def stabilize(linear: LinearizedObject, sigma_rad: float, mu: float) -> InternalFeedback:
    """Return the weakest feedback with which μ, and no longer σ, limits the acceleration s.

    More gain would hardly raise s = μ / g_H, because g_H ≥ 1, but would cancel ever more of the
    task's acceleration instead of the swing.

    Args:
        linear: an object without damping, or with too little.
        sigma_rad: σ of Eq. (9).
        mu: μ, what the object's feedback may use, m/s².

    Raises:
        ParameterError: σ or μ out of range, or an object that this input cannot stabilize.
        CertificateError: its equilibrium alone uses up σ.
    """
    sigma_rad = validated_sigma(sigma_rad)
    mu = require_positive("mu", mu, "m/s²")
    budget = sigma_rad - float(np.abs(linear.equilibrium).max())
    if not budget > 0:
        raise CertificateError(
            "sigma_rad", sigma_rad, f"σ > sup‖z2*‖∞ = {sigma_rad - budget:.4g}", "Admit a larger σ."
        )

    @cache
    def room(exponent: float) -> float:
        feedback = internal_feedback(linear, sigma_rad, mu, 10.0**exponent)
        return math.log(budget * feedback.feedback_gain / (mu * feedback.swing_gain))

    start = 2 * math.log10(mu / budget)
    low = high = start
    while room(low) > 0 and low > start - _MOST_DECADES:
        low, high = low - 1, low
    while room(high) < 0 and high < start + _MOST_DECADES:
        low, high = high, high + 1
    if room(low) < 0 < room(high):
        high = brentq(room, low, high, xtol=_PRECISION_DECADES)
    return internal_feedback(linear, sigma_rad, mu, 10.0**high)


def _riccati_feedback(linear: LinearizedObject, epsilon: float) -> Array:
    b = linear.forward_input[:, None]
    gain, _, _ = control.lqr(linear.A_u, b, epsilon * np.eye(len(b)), np.eye(1), method="scipy")
    return np.asarray(-gain[0], dtype=np.float64)
