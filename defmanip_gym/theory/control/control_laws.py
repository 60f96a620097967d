"""Saturated velocity tracking (20), the PI force loop (27)–(29) and limits on acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_non_negative, settle


def saturated_tracking(
    velocity_error: Array, gain: float, bound: Array, feedforward: Array | float = 0.0
) -> Array:
    """Return u_o = sat(L ė_z1 + z̈_1d) of Eq. (20) with L = −gain · I.

    Args:
        velocity_error: ė_z1 = ż1 − ż_1d, (..., 3) m/s.
        gain: ε, 1/s.
        bound: largest |u_o| on each axis, (..., 3) m/s²; the s of Eq. (19).
        feedforward: z̈_1d, (..., 3) m/s²; the paper lets it be zero.
    """
    return np.clip(feedforward - gain * velocity_error, -bound, bound)


@dataclass(frozen=True, kw_only=True)
class ForceLoopGains:
    """k1 (dimensionless) and k2 (1/s) of Eq. (29)."""

    k1: float = 0.2
    k2: float = 1.0

    def __post_init__(self) -> None:
        settle(self, "k1", require_non_negative)
        settle(self, "k2", require_non_negative)


def force_loop(u_o: Array, error: Array, error_integral: Array, gains: ForceLoopGains) -> Array:
    """Return w = L ė_z1 − k1 Δu_o − k2 ∫Δu_o of Eq. (29), (..., 3) m/s²."""
    return u_o - gains.k1 * error - gains.k2 * error_integral


def integrate_unless_saturated(
    error_integral: Array, error: Array, w: Array, bound: Array, period_s: float
) -> Array:
    """Return ∫Δu_o one sample on, held where it would push a saturated w further out.

    Args:
        error_integral: ∫Δu_o so far, (..., 3) m/s.
        error: Δu_o, (..., 3) m/s².
        w: the command of this sample before saturation, (..., 3) m/s².
        bound: its bound on each axis, (..., 3) m/s².
        period_s: sampling period.
    """
    pushes_out = (np.abs(w) >= bound) & (np.sign(w) == -np.sign(error))
    return error_integral + period_s * np.where(pushes_out, 0.0, error)


def limit_speed(w: Array, velocity: Array, max_speed: float, period_s: float) -> Array:
    """Return w changed as little as needed to keep the grasp below a speed one period ahead.

    Braking passes unchanged, also from above the limit, and the result is never longer than w.

    Args:
        w: commanded acceleration, (..., 3) m/s².
        velocity: grasp velocity in the same frame, (..., 3) m/s.
        max_speed: the limit, m/s.
        period_s: control period.
    """
    limited = np.array(w, dtype=np.float64)
    along = np.ascontiguousarray(velocity, dtype=np.float64)
    _limit_speeds(limited.reshape(-1, 3), along.reshape(-1, 3), float(max_speed), float(period_s))
    return limited


@compilable
def limited_acceleration(
    w_x: float,
    w_y: float,
    w_z: float,
    v_x: float,
    v_y: float,
    v_z: float,
    max_speed: float,
    period_s: float,
) -> tuple[float, float, float]:
    """Return w of one state, limited so, by its components and those of the velocity."""
    ahead_x, ahead_y, ahead_z = v_x + period_s * w_x, v_y + period_s * w_y, v_z + period_s * w_z
    speed_ahead = sqrt(ahead_x**2 + ahead_y**2 + ahead_z**2)
    allowed = max(max_speed, sqrt(v_x**2 + v_y**2 + v_z**2))
    if speed_ahead > allowed:
        shrink = allowed / speed_ahead
        w_x = (ahead_x * shrink - v_x) / period_s
        w_y = (ahead_y * shrink - v_y) / period_s
        w_z = (ahead_z * shrink - v_z) / period_s
    return w_x, w_y, w_z


@compiled
def _limit_speeds(w: Array, velocity: Array, max_speed: float, period_s: float) -> None:
    for i in range(len(w)):
        w[i, 0], w[i, 1], w[i, 2] = limited_acceleration(
            w[i, 0],
            w[i, 1],
            w[i, 2],
            velocity[i, 0],
            velocity[i, 1],
            velocity[i, 2],
            max_speed,
            period_s,
        )
