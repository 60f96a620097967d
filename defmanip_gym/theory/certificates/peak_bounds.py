"""How far a bounded acceleration drives a linear object: four bounds, from loose to exact.

Each takes the linearization (16) and returns, for every component of η = (z2 − z2*, ż2), a number
g_k with |η_k(t)| ≤ g_k sup|a| from rest, where a is the horizontal acceleration along each axis.
"""

from __future__ import annotations

import math

import control
import numpy as np

from defmanip_gym.theory.certificates.impulse_response import peak_gains
from defmanip_gym.theory.certificates.iss_gain import iss_gain
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, lyapunov_matrix

_DECAY_SHARES = np.linspace(0.02, 0.98, 49)


def tanner_bound(linear: LinearizedObject) -> Array:
    """Return 8 N² λ_M λ_M(B_u) √(λ_M/λ_m), what Eq. (21) implies for ‖ν‖∞; (2N,)."""
    return _uniform(linear, _gain_of_equation_21(linear, lyapunov_matrix(linear.A_u)))


def tanner_printed_bound(linear: LinearizedObject) -> Array:
    """Return the same with the radical as printed in Eq. (18), √(λ_m/λ_M): no bound; (2N,)."""
    P = lyapunov_matrix(linear.A_u)
    smallest, largest = np.linalg.eigvalsh(P)[[0, -1]]
    return _uniform(linear, _gain_of_equation_21(linear, P) * smallest / largest)


def lyapunov_bound(linear: LinearizedObject) -> Array:
    """Return 2 λ_M √(λ_M/λ_m) ‖b‖₂: the same P without the slack of norm conversions; (2N,).

    With V = ηᵀ P η: V̇ ≤ −‖η‖² + 2 λ_M ‖η‖ ‖b‖ |a|, so V rises only inside ‖η‖ ≤ 2 λ_M ‖b‖ |a|.
    """
    smallest, largest = np.linalg.eigvalsh(lyapunov_matrix(linear.A_u))[[0, -1]]
    columns = np.linalg.norm(horizontal_inputs(linear), axis=0).sum()
    return _uniform(linear, 2 * largest * math.sqrt(largest / smallest) * columns)


def ellipsoid_bound(linear: LinearizedObject) -> Array:
    """Return the best invariant ellipsoid's extent along each axis, (2N,).

    For each α > 0 with A + α/2 I Hurwitz, {ηᵀ Q⁻¹ η ≤ 1} with (A + α/2 I) Q + Q (A + α/2 I)ᵀ +
    b bᵀ/α = 0 holds all that |a| ≤ 1 can reach (J. Abedor, K. Nagpal, K. Poolla, "A linear matrix
    inequality approach to peak-to-peak gain minimization", Int. J. Robust Nonlinear Control 6,
    1996). Any α gives a bound; a grid comes within 0.1 % of the best.
    """
    fastest_shift = -2 * np.linalg.eigvals(linear.A_u).real.max()
    identity, total = np.eye(2 * linear.count), np.zeros(2 * linear.count)
    for column in horizontal_inputs(linear).T:
        extents = []
        for alpha in fastest_shift * _DECAY_SHARES:
            Q = control.lyap(linear.A_u + alpha / 2 * identity, np.outer(column, column) / alpha)
            extents.append(np.sqrt(np.maximum(np.diag(Q), 0.0)))
        total += np.min(extents, axis=0)
    return total


def l1_bound(linear: LinearizedObject) -> Array:
    """Return ∫₀^∞ |e^{At} b| dt, the exact peak gain, (2N,): some input attains it."""
    everything = np.eye(2 * linear.count)
    return peak_gains(linear.A_u, horizontal_inputs(linear), everything).sum(axis=1)


def resonant_limit(linear: LinearizedObject, budget: float) -> float:
    """Return budget / ‖G‖∞, m/s²: a forward sinusoid of this amplitude uses up the budget.

    No certificate of the linear model can exceed it; ‖G‖∞ is the largest over the coordinates.
    """
    A, b = linear.A_u, linear.forward_input[:, None]
    peaks = [
        control.norm(control.ss(A, b, np.eye(2 * linear.count)[k : k + 1], 0), p="inf")
        for k in range(linear.count)
    ]
    return float(budget / max(peaks))


def horizontal_inputs(linear: LinearizedObject) -> Array:
    """Return the columns of B_u for forward and, where it acts, leftward acceleration."""
    columns = linear.B_u[:, 6:8]
    return columns[:, np.abs(columns).max(axis=0) > 0]


def _gain_of_equation_21(linear: LinearizedObject, P: Array) -> float:
    """Return γ(sup‖B_u ν‖) for ‖ν‖∞ = 1 with ‖B_u ν‖ ≤ √(2N) λ_M(B_u): 8 N² λ_M(P) λ_M(B_u) √…."""
    input_gain = float(np.linalg.norm(linear.B_u, 2))  # λ_M(B_u) = √λ_max(B_u B_uᵀ)
    return iss_gain(P, linear.count, math.sqrt(2 * linear.count) * input_gain)


def _uniform(linear: LinearizedObject, gain: float) -> Array:
    return np.full(2 * linear.count, gain)
