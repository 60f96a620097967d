"""Sampled linear-quadratic regulators of grasp and swing.

Grasp position and velocity along one axis are a double integrator; forward acceleration swings the
object as its linearization (16) says. Zero-order hold makes exact samples of both, and the discrete
Riccati equation the feedback that minimizes Σ xᵀ Q x + R w²: B. D. O. Anderson, J. B. Moore,
"Optimal Control: Linear Quadratic Methods", Prentice-Hall 1990.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
from scipy.linalg import expm

from defmanip_gym.errors import GainError
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject
from defmanip_gym.validation import require_non_negative, require_positive, settle


@dataclass(frozen=True, kw_only=True)
class LqrWeights:
    """What a regulator pays for each error; acceleration costs 1 per (m/s²)².

    Attributes:
        position: per m².
        velocity: per (m/s)².
        swing: per rad² of each internal coordinate's distance from its rest.
        swing_rate: per (rad/s)².
    """

    position: float = 4.4
    velocity: float = 0.85
    swing: float = 15.4
    swing_rate: float = 0.165

    def __post_init__(self) -> None:
        settle(self, "position", require_positive)
        for name in ("velocity", "swing", "swing_rate"):
            settle(self, name, require_non_negative)


def sampled(A: Array, B: Array, period_s: float) -> tuple[Array, Array]:
    """Return the exact sampled pair of ẋ = A x + B w, w held over a period; B is (k,) or (k, m)."""
    size, columns = len(A), B.reshape(len(A), -1)
    held = np.zeros((columns.shape[1], size + columns.shape[1]))
    whole = expm(np.vstack((np.hstack((A, columns)), held)) * period_s)
    return whole[:size, :size], whole[:size, size:].reshape(B.shape)


def forward_motion(linear: LinearizedObject) -> tuple[Array, Array]:
    """Return A, B of (p, v, z2 − z2*, ż2) under forward acceleration: (2 + 2N)², (2 + 2N,)."""
    size = 2 + 2 * linear.count
    A, B = np.zeros((size, size)), np.zeros(size)
    A[0, 1], B[1] = 1.0, 1.0
    A[2:, 2:], B[2:] = linear.A_u, linear.forward_input
    return A, B


def quasi_static_swing(linear: LinearizedObject) -> Array:
    """Return where the object comes to rest per m/s² of forward acceleration, (N,) rad s²/m."""
    rest = np.linalg.solve(linear.A_u, linear.forward_input)[: linear.count]
    return np.asarray(-rest, dtype=np.float64)


def forward_gains(linear: LinearizedObject, weights: LqrWeights, period_s: float) -> Array:
    """Return K of w = −K (p, v, z2 − z2*, ż2), (2 + 2N,).

    Raises:
        GainError: the Riccati equation has no stabilizing solution.
    """
    return _gains(*forward_motion(linear), _diagonal(weights, linear.count), period_s)


def side_gains(weights: LqrWeights, period_s: float) -> Array:
    """Return K of w = −K (p, v) along an axis that does not swing the object, (2,)."""
    return _gains(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), _diagonal(weights, 0), period_s
    )


def _diagonal(weights: LqrWeights, count: int) -> Array:
    """Return the diagonal of Q, with the weights of the swing for each coordinate."""
    return np.array(
        [weights.position, weights.velocity]
        + count * [weights.swing]
        + count * [weights.swing_rate]
    )


def _gains(A: Array, B: Array, diagonal: Array, period_s: float) -> Array:
    A_d, B_d = sampled(A, B, period_s)
    try:
        K, _, poles = control.dlqr(A_d, B_d[:, None], np.diag(diagonal), np.eye(1))
    except (ValueError, np.linalg.LinAlgError) as error:
        raise _no_regulator(diagonal) from error
    if not np.abs(poles).max() < 1.0:
        raise _no_regulator(diagonal)
    return np.asarray(K, dtype=np.float64)[0]


def _no_regulator(diagonal: Array) -> GainError:
    return GainError(
        "LQR weights",
        diagonal.tolist(),
        "weights whose Riccati equation has a stabilizing solution",
        "Weigh position and swing more, or shorten the control period.",
    )
