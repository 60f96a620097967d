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
    leftward = np.clip(
        limited[..., 1],
        reach * (-rate - u2) / period_s + centripetal,
        reach * (rate - u2) / period_s + centripetal,
    )
    resulting = np.stack(
        (
            np.clip(limited[..., 0], -forward, forward),
            leftward,
            np.clip(limited[..., 2], -upward, upward),
        ),
        axis=-1,
    )
    return resulting - disturbance
