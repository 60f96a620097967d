"""The paper's control law on physical quantities: field → tracking (20) → PI force loop (29).

``tanner.TannerController`` reads these quantities from observations; whoever has them at hand
calls the cascade directly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.baselines.analytic.field_tracking import FieldTracking
from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.theory.control.control_laws import (
    ForceLoopGains,
    force_loop,
    integrate_unless_saturated,
)
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.object_model import HangingBeam


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
class Cascade(FieldTracking):
    """Velocity field, saturated tracking and force loop of Sections III and IV.

    Attributes:
        object: with the damping that the force law (10) assumes.
        gains: k1 and k2 of the force loop (29).
        w_limit: largest |w| that will be realized, m/s²; the integral holds beyond it.
    """

    object: HangingBeam
    gains: ForceLoopGains
    w_limit: float

    def command(self, now: GraspSample, memory: LoopMemory) -> Command:
        """Return w of Eq. (29) and what to remember."""
        # Section IV: Δu_o compares the measured force with the one the last u_o called for
        error = self.object.acceleration_error(
            now.swing, now.swing_rate, now.yaw_rate, memory.u_o, now.force_b
        )
        return self.force_feedback(self.tracking(now), error, memory)

    def force_feedback(self, u_o: Array, error: Array, memory: LoopMemory) -> Command:
        """Return the command of Eq. (29) for u_o and the force error Δu_o, (n, 3) m/s² each."""
        advanced = memory.error_integral + self.period_s * error
        w = force_loop(u_o, error, advanced, self.gains)
        # only u_o is bounded by the certificate: the rest of w makes up for disturbances
        error_integral = integrate_unless_saturated(
            memory.error_integral, error, w, np.full(3, self.w_limit), self.period_s
        )
        return Command(w=w, memory=LoopMemory(error_integral=error_integral, u_o=u_o))
