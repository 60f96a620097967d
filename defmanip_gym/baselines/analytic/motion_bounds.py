"""How far the paper's controller may go: by its own choice, or within a certificate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.field_tracking import YAW_SHARE
from defmanip_gym.baselines.analytic.tanner_params import TannerParams
from defmanip_gym.errors import CertificateError
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.control.oriented_field import OrientedField
from defmanip_gym.theory.control.velocity_field import LiteralField, NormalizedField, VelocityField


@dataclass(frozen=True, kw_only=True)
class MotionBounds:
    """Bounds on the commanded motion.

    Attributes:
        acceleration: on |w| per axis, forward, left and up, (3,) m/s².
        yaw_rate: rad/s.
        speed: of the field, m/s.
    """

    acceleration: NDArray[np.float64]
    yaw_rate: float
    speed: float

    def velocity_field(self, params: TannerParams, goal_reach_m: float) -> VelocityField:
        """Return ż_1d of Section IV.A within the bounds."""
        if params.velocity_field == "literal":
            return LiteralField(k=params.literal_k)
        forward, leftward, upward = self.acceleration.tolist()
        braking = params.deceleration_share
        if params.velocity_field == "normalized":
            return NormalizedField(
                max_speed_m_s=self.speed,
                deceleration_m_s2=braking * forward,
                vertical_deceleration_m_s2=braking * upward,
                approach_rate_per_s=params.approach_rate,
            )
        return OrientedField(
            reach_m=goal_reach_m,
            max_speed_m_s=self.speed,
            deceleration_m_s2=braking * forward,
            vertical_deceleration_m_s2=braking * upward,
            approach_rate_per_s=params.approach_rate,
            lateral_acceleration_m_s2=params.bound_share * leftward,
            yaw_rate_rad_s=YAW_SHARE * self.yaw_rate,
            turn_radius_m=params.turn_radius,
        )


def motion_bounds(
    params: TannerParams, task: TaskParams, certificate: Certificate | None, coordinate_count: int
) -> MotionBounds:
    """Return the bounds of a certificate, or the controller's own without one.

    Args:
        params: its design choices.
        task: limits of the task.
        certificate: None for none.
        coordinate_count: N of the beam carried.

    Raises:
        CertificateError: the certificate is for another N, or leaves no room to turn or to lift.
    """
    if certificate is None:
        return MotionBounds(
            acceleration=np.full(3, min(params.acceleration_bound, task.max_acceleration_m_s2)),
            yaw_rate=params.yaw_rate_bound,
            speed=params.speed_share * task.max_speed_m_s,
        )
    _require_fit(certificate, coordinate_count)
    limit = task.max_acceleration_m_s2
    forward = min(certificate.acceleration_bound, limit)
    leftward = limit if math.isinf(certificate.speed_bound) else forward
    upward = min(certificate.vertical_acceleration_bound, limit)
    return MotionBounds(
        acceleration=np.array([forward, leftward, upward]),
        yaw_rate=min(certificate.conditions.yaw_rate_rad_s, params.yaw_rate_bound),
        speed=params.speed_share * min(task.max_speed_m_s, certificate.speed_bound),
    )


def _require_fit(certificate: Certificate, coordinate_count: int) -> None:
    if certificate.coordinate_count != coordinate_count:
        raise CertificateError(
            "certificate.coordinate_count",
            certificate.coordinate_count,
            f"{coordinate_count}, that of the beam carried",
            "Compute the certificate for this beam.",
        )
    if min(certificate.vertical_acceleration_bound, certificate.conditions.yaw_rate_rad_s) <= 0:
        raise CertificateError(
            "certificate.conditions",
            certificate.conditions,
            "room for vertical acceleration and yaw rate",
            "Pass conditions=TRANSPORT_CONDITIONS to certify().",
        )
