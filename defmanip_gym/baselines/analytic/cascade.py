"""The paper's control law on physical quantities: field → tracking (20) → PI force loop (29).

``tanner.TannerController`` reads these quantities from observations; whoever has them at hand
calls the cascade directly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.theory.control.control_laws import (
    ForceLoopGains,
    force_loop,
    integrate_unless_saturated,
    saturated_tracking,
)
from defmanip_gym.theory.control.velocity_field import VelocityField
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base
from defmanip_gym.theory.payload.object_model import HangingBeam

# share of the yaw rate bound that desired velocities use
YAW_SHARE = 0.8


@dataclass(frozen=True, kw_only=True)
class LoopMemory:
    """What the force loop carries from sample to sample.

    Attributes:
        error_integral: ∫Δu_o, (n, 3) m/s.
        u_o: what the last sample asked for, (n, 3) m/s².
    """

    error_integral: Array
    u_o: Array

    @staticmethod
    def empty(count: int) -> LoopMemory:
        """Return that of ``count`` episodes that begin."""
        return LoopMemory(error_integral=np.zeros((count, 3)), u_o=np.zeros((count, 3)))


@dataclass(frozen=True, kw_only=True)
class Command:
    """What one sample decides.

    Attributes:
        w: Eq. (29), not yet saturated, (n, 3) m/s², base frame.
        memory: for the next sample.
    """

    w: Array
    memory: LoopMemory


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """Velocity field, saturated tracking and force loop of Sections III and IV.

    Attributes:
        object: with the damping that the force law (10) assumes.
        field: ż_1d.
        tracking_gain: ε in L = −ε I, 1/s.
        gains: k1 and k2 of the force loop (29).
        u_o_bound: largest |u_o| per axis, (3,) m/s²; the s of Eq. (19).
        w_limit: largest |w| that will be realized, m/s²; the integral holds beyond it.
        yaw_rate_bound: rad/s.
        period_s: sampling period.
        feedforward: add z̈_1d, the field's change along the motion; the paper has none.
    """

    object: HangingBeam
    field: VelocityField
    tracking_gain: float
    gains: ForceLoopGains
    u_o_bound: Array
    w_limit: float
    yaw_rate_bound: float
    period_s: float
    feedforward: bool

    def command(self, now: GraspSample, memory: LoopMemory) -> Command:
        """Return w of Eq. (29) and what to remember."""
        # Section IV: Δu_o compares the measured force with the one the last u_o called for
        error = self.object.acceleration_error(
            now.swing, now.swing_rate, now.yaw_rate, memory.u_o, now.force_b
        )
        return self.force_feedback(self.tracking(now), error, memory)

    def tracking(self, now: GraspSample) -> Array:
        """Return u_o of Eq. (20), (n, 3) m/s²."""
        desired, desired_rate = self._desired_motion(now)
        return saturated_tracking(
            now.velocity_b - self._with_gentle_turn(desired, now.reach),
            self.tracking_gain,
            self.u_o_bound,
            desired_rate,
        )

    def force_feedback(self, u_o: Array, error: Array, memory: LoopMemory) -> Command:
        """Return the command of Eq. (29) for u_o and the force error Δu_o, (n, 3) m/s² each."""
        advanced = memory.error_integral + self.period_s * error
        w = force_loop(u_o, error, advanced, self.gains)
        # only u_o is bounded by the certificate: the rest of w makes up for disturbances
        error_integral = integrate_unless_saturated(
            memory.error_integral, error, w, np.full(3, self.w_limit), self.period_s
        )
        return Command(w=w, memory=LoopMemory(error_integral=error_integral, u_o=u_o))

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
