"""Acceleration commands scaled into a certificate, component by component (Remark IV.1).

The paper scales its gains by a function of the margin to ν_max; scaling the command itself does
the same for any controller and is exact: nothing is given away while the bounds are respected.
What deforms the object is the acceleration that results, so the bounds hold for the command plus
the disturbance that the last period showed.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.control.control_laws import limit_speed
from defmanip_gym.theory.dynamics.chain import Array


def certified_command(
    w: Array,
    grasp_velocity: Array,
    base_velocity: Array,
    reach: Array,
    certificate: Certificate,
    *,
    disturbance: Array,
    max_speed: float,
    period_s: float,
) -> Array:
    """Return the command nearest to w whose resulting acceleration respects the certificate.

    Forward and vertical acceleration excite the swing and are clipped to their bounds. Sideways
    acceleration only turns the base, so it is bounded through the yaw rate one period ahead.
    Braking stays possible: the speed limit never asks for more than w did.

    Args:
        w: commanded acceleration, (..., 3) m/s², base frame.
        grasp_velocity: (..., 3) m/s, base frame.
        base_velocity: (u1, u2), (..., 2).
        reach: ρ, (...) m.
        certificate: the bounds.
        disturbance: by how much the acceleration exceeded its command in the last period,
            (..., 3) m/s².
        max_speed: the environment's own speed limit, m/s.
        period_s: control period.
    """
    speed = min(max_speed, certificate.speed_bound)
    limited = limit_speed(w + disturbance, grasp_velocity, speed, period_s)
    forward, upward = certificate.acceleration_bound, certificate.vertical_acceleration_bound
    u1, u2 = base_velocity[..., 0], base_velocity[..., 1]
    reach_rate = grasp_velocity[..., 0] - u1
    # leftward acceleration = ρ u̇2 + 2 ρ̇ u2 + u1 u2
    centripetal = 2 * reach_rate * u2 + u1 * u2
    rate = certificate.commanded_yaw_rate_rad_s
    rightmost = reach * (-rate - u2) / period_s + centripetal
    leftmost = reach * (rate - u2) / period_s + centripetal
    low = np.stack(np.broadcast_arrays(-forward, rightmost, -upward), axis=-1)
    high = np.stack(np.broadcast_arrays(forward, leftmost, upward), axis=-1)
    command = np.clip(limited, low, high) - disturbance
    low, high = low - disturbance, high - disturbance
    coasting = _coasting(low, high, grasp_velocity, speed, period_s)
    return _slowed(command, coasting, grasp_velocity, speed, period_s)


def _coasting(low: Array, high: Array, velocity: Array, limit: float, period_s: float) -> Array:
    """Return the command nearest to none within bounds (..., 3) that the speed limit leaves alone.

    The environment's limiter sees the command without the disturbance that it makes up for. Where
    holding the other axes alone would exceed the limit, the forward one brakes.
    """
    coasting = np.clip(0.0, low, high)
    allowed = np.maximum(limit**2, _square(velocity))
    others = _square((velocity + period_s * coasting)[..., 1:])
    speed = np.sqrt(np.maximum(allowed - others, 0.0))
    slowed = np.clip(
        coasting[..., 0],
        (-speed - velocity[..., 0]) / period_s,
        (speed - velocity[..., 0]) / period_s,
    )
    coasting[..., 0] = np.clip(slowed, low[..., 0], high[..., 0])
    return coasting


def _slowed(
    command: Array, coasting: Array, velocity: Array, limit: float, period_s: float
) -> Array:
    """Return the farthest point from ``coasting`` to ``command`` within the speed limit.

    Clipping to the bounds may undo braking that the speed limit asked for; left to itself the
    environment's limiter would then brake harder than certified.
    """
    start, change = velocity + period_s * coasting, period_s * (command - coasting)
    allowed = np.maximum(limit**2, np.maximum(_square(velocity), _square(start)))
    a, b, c = _square(change), (start * change).sum(-1), _square(start) - allowed
    share = (np.sqrt(np.maximum(b**2 - a * c, 0.0)) - b) / np.where(a > 0, a, 1.0)
    share = np.where(a > 0, np.clip(share, 0.0, 1.0), 1.0)
    return coasting + share[..., None] * (command - coasting)


def _square(vector: Array) -> Array:
    return (vector**2).sum(-1)
