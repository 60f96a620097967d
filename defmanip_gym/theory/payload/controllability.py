"""Controllability of (A_u, B_u), assumed below Eq. (16), by the Popov-Belevitch-Hautus test.

The rank of (B, AB, A²B, …), python-control's ``ctrb``, drowns in rounding for objects with stiff
joints: the columns grow as |λ|^k. Hautus asks one question per eigenvalue and squares nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import matrix_balance

from defmanip_gym.theory.dynamics.chain import Array

# Uncontrollable modes come out of double precision near 1e-15, twelve free segments at 1e-9.
_ROUNDING = 1e-12


def is_controllable(A: Array, B: Array) -> bool:
    """Whether inputs B (k, inputs) reach every state of A (k, k)."""
    return hautus_margin(A, B) > _ROUNDING


def hautus_margin(A: Array, B: Array) -> float:
    """Return min over eigenvalues λ of the smallest singular value of [A − λI, B].

    Zero exactly where a mode cannot be reached. In balanced coordinates and with B as large as A,
    so that neither the units of the states nor those of the inputs matter.
    """
    if not B.any():
        return 0.0
    balanced, scaling = matrix_balance(A)
    inputs = np.linalg.solve(scaling, B)
    size = np.linalg.norm(balanced, 2)
    inputs = inputs * (size / np.linalg.norm(inputs))
    unit = np.eye(len(A))
    return min(
        float(np.linalg.svd(np.hstack((balanced - root * unit, inputs)), compute_uv=False)[-1])
        for root in np.linalg.eigvals(balanced)
    ) / float(size)
