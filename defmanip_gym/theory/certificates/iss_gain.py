"""The input-to-state gain γ of Eqs. (15), (17) and the bound (21) that it gives."""

from __future__ import annotations

import math

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array


def iss_gain(P: Array, count: int, rho: float) -> float:
    """Return γ(ρ) = 4 √(2 (n−m)³) λ_M(P) √(λ_M(P)/λ_m(P)) ρ, Eq. (17).

    Args:
        P: Lyapunov matrix of A_u, or of A_u + B_u H, (2N, 2N).
        count: n − m, the number N of internal coordinates.
        rho: size of the input, in units of η̇.
    """
    smallest, largest = np.linalg.eigvalsh(P)[[0, -1]]
    return float(4 * math.sqrt(2 * count**3) * largest * math.sqrt(largest / smallest) * rho)


def deformation_bound(P: Array, B_u: Array, largest_input: Array) -> float:
    """Return the bound (21) on ‖η‖∞ from rest, γ(sup‖B_u ν‖∞).

    Args:
        P: Lyapunov matrix, (2N, 2N).
        B_u: (2N, inputs).
        largest_input: sup|ν_j| of each input, (inputs,).
    """
    reached = float((np.abs(B_u) @ np.abs(largest_input)).max())
    return iss_gain(P, len(P) // 2, reached)
