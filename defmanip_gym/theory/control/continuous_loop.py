"""The closed loop in continuous time, Section V: Eqs. (30), (32)–(34) and Proposition V.1.

The state is (ė_z1, Δu_o): (33a) is first order in the *velocity* error, so nothing here speaks of
positions. (33a)–(34) is block triangular, hence exponentially stable for every k2 > 0 and Hurwitz
L; k2 > k2* is what the Lyapunov function W3 of the paper needs, not what the loop needs. What
sampling needs is in ``stability``.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import lyapunov_matrix


def closed_loop_matrix(L: Array, gains: ForceLoopGains) -> Array:
    """Return the matrix of (33a)–(34) for the state (ė_z1, Δu_o), (2m, 2m), in 1/s and s⁰.

    Args:
        L: tracking gain of Eq. (20), (m, m) 1/s.
        gains: k1, k2 of Eq. (29).
    """
    unit = np.eye(len(L))
    return np.block([[L, unit], [0 * unit, -gains.k2 / (1 + gains.k1) * unit]])


def lyapunov_w3(
    L: Array, gains: ForceLoopGains, velocity_error: Array, error: Array, weight: float = 1.0
) -> Array:
    """Return W3 = ė_z1ᵀ P_e ė_z1 + weight · (k1 + 1)/2 ‖Δu_o‖² of Proposition V.1, (...).

    Args:
        L: tracking gain, Hurwitz, (m, m) 1/s.
        gains: k1, k2.
        velocity_error: ė_z1, (..., m) m/s.
        error: Δu_o, (..., m) m/s².
        weight: of W2 in the sum; 1 in the paper. Any weight above k2*/k2 makes W3 decrease.
    """
    P_e = lyapunov_matrix(L)
    W1 = np.einsum("...i,ij,...j->...", velocity_error, P_e, velocity_error)
    return W1 + weight * 0.5 * (gains.k1 + 1) * (error**2).sum(-1)


def lyapunov_w3_rate(
    L: Array, gains: ForceLoopGains, velocity_error: Array, error: Array, weight: float = 1.0
) -> Array:
    """Return Ẇ3 = −‖ė_z1‖² + 2 ė_z1ᵀ P_e Δu_o − weight · k2 ‖Δu_o‖², (...); arguments as above."""
    P_e = lyapunov_matrix(L)
    cross = np.einsum("...i,ij,...j->...", velocity_error, P_e, error)
    return -(velocity_error**2).sum(-1) + 2 * cross - weight * gains.k2 * (error**2).sum(-1)
