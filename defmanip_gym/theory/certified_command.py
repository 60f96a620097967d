"""Acceleration commands scaled into a certificate, component by component (Remark IV.1).

The paper scales its gains by a function of the margin to ν_max; scaling the command itself does
the same for any controller and is exact: nothing is given away while the bounds are respected.
What deforms the object is the acceleration that results, so the bounds hold for the command plus
the disturbance that the last period showed.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.chain import Array
from defmanip_gym.theory.control_laws import limit_speed

# Sampled feedback linearization overshoots a rate by a fraction of a percent.
_YAW_RATE_SHARE = 0.98


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
    rate = _YAW_RATE_SHARE * certificate.conditions.yaw_rate_rad_s
    rightmost = reach * (-rate - u2) / period_s + centripetal
    leftmost = reach * (rate - u2) / period_s + centripetal
    resulting = np.stack(
        (
            np.clip(limited[..., 0], -forward, forward),
            np.clip(limited[..., 1], rightmost, leftmost),
            np.clip(limited[..., 2], -upward, upward),
        ),
        axis=-1,
    )
    coasting = np.zeros_like(resulting)
    coasting[..., 1] = np.clip(0.0, rightmost, leftmost)
    return _slowed(resulting - disturbance, coasting - disturbance, grasp_velocity, speed, period_s)


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
