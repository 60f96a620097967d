"""Velocity field and saturated tracking (20): what the field's controllers have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.theory.control.control_laws import saturated_tracking
from defmanip_gym.theory.control.velocity_field import VelocityField
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base

# share of the yaw rate bound that desired velocities use
YAW_SHARE = 0.8


@dataclass(frozen=True, kw_only=True)
class FieldTracking:
    """A desired velocity at each position, and the acceleration that leads to it.

    Attributes:
        field: ż_1d.
        tracking_gain: ε in L = −ε I, 1/s.
        u_o_bound: largest |u_o| per axis, (3,) m/s²; the s of Eq. (19).
        yaw_rate_bound: rad/s.
        period_s: sampling period.
        feedforward: add z̈_1d, the field's change along the motion; the paper has none.
    """

    field: VelocityField
    tracking_gain: float
    u_o_bound: Array
    yaw_rate_bound: float
    period_s: float
    feedforward: bool

    def tracking(
        self,
        now: GraspSample,
        added_velocity: Array | float = 0.0,
        added_acceleration: Array | float = 0.0,
    ) -> Array:
        """Return u_o of Eq. (20), (n, 3) m/s².

        Args:
            now: grasp and object.
            added_velocity: wanted beside the field's, (n, 3) m/s.
            added_acceleration: its rate of change, (n, 3) m/s².
        """
        desired, desired_rate = self._desired_motion(now)
        return saturated_tracking(
            now.velocity_b - (self._with_gentle_turn(desired, now.reach) + added_velocity),
            self.tracking_gain,
            self.u_o_bound,
            desired_rate + added_acceleration,
        )

    def _desired_motion(self, now: GraspSample) -> tuple[Array, Array | float]:
        """Return ż_1d of Section IV.A and its rate of change along the motion, (n, 3) each.

        The field lives in world axes with the goal at the origin. The paper lets z̈_1d = 0; without
        it the grasp drifts off its streamline.
        """
        desired = self.field.velocity(now.position, now.heading)
        if not self.feedforward:
            return world_to_base(desired, now.heading), 0.0
        period = self.period_s
        ahead = now.position + period * base_to_world(now.velocity_b, now.heading)
        turned = now.heading + period * now.yaw_rate
        rate = (self.field.velocity(ahead, turned) - desired) / period
        return world_to_base(desired, now.heading), world_to_base(rate, now.heading)

    def _with_gentle_turn(self, desired: Array, reach: Array) -> Array:
        """Bound the leftward velocity, which is reach times yaw rate."""
        limit = YAW_SHARE * self.yaw_rate_bound * reach
        return np.stack(
            (desired[:, 0], np.clip(desired[:, 1], -limit, limit), desired[:, 2]), axis=1
        )
