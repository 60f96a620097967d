"""A disturbance observer on w: what the grasp does beside what was asked of it, taken off again.

    d ← d + L T ((v̇ − w_last) − d),   w = u_o − d

v̇ is the mean acceleration of the last period, from two velocities; no model of the object enters.
It takes the place of the PI loop of Section IV, which integrates the same error as seen by the
force sensor through the object's model (docs/derivations.md has both side by side).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.errors import GainError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams
from defmanip_gym.theory.control.control_laws import limit_speed
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base
from defmanip_gym.theory.dynamics.task_space import task_inertia
from defmanip_gym.validation import require_non_negative, require_positive, settle


@dataclass(frozen=True, kw_only=True)
class ObserverMemory:
    """What the observer carries from sample to sample.

    Attributes:
        estimate: d, (n, 3) m/s², base frame.
        w: what the last sample asked for, as far as limits let it through, (n, 3) m/s².
        velocity: of the grasp at the last sample in axes that do not turn, (n, 3) m/s.
    """

    estimate: Array
    w: Array
    velocity: Array


@dataclass(frozen=True, kw_only=True)
class DisturbanceObserver:
    """The observer with the limits that stand between w and the robot.

    Attributes:
        gain: L, 1/s; 0 keeps the first estimate.
        period_s: T.
        w_limit: largest |w| on each axis, m/s².
        max_speed_m_s: of the limiter behind it.

    Raises:
        GainError: the observer by itself would be unstable.
    """

    gain: float
    period_s: float
    w_limit: float
    max_speed_m_s: float

    def __post_init__(self) -> None:
        settle(self, "gain", require_non_negative, "1/s")
        for name in ("period_s", "w_limit", "max_speed_m_s"):
            settle(self, name, require_positive)
        if self.gain * self.period_s >= 2.0:  # d[k+1] = (1 − L T) d[k] by itself
            raise GainError(
                "observer gain",
                self.gain,
                f"below 2/T = {2.0 / self.period_s:g} 1/s, for a spectral radius below 1",
                "Lower it; loops around the observer and delays leave less.",
            )

    def updated(
        self, memory: ObserverMemory, velocity_b: Array, heading: Array, yaw_rate: Array
    ) -> Array:
        """Return d, (n, 3) m/s², one sample later.

        Args:
            memory: of the last sample.
            velocity_b: of the grasp now, (n, 3) m/s.
            heading: of the base frame, (n,) rad.
            yaw_rate: u2, (n,) rad/s.
        """
        gained = base_to_world(velocity_b, heading) - memory.velocity
        # the base turned meanwhile: w was meant in axes half-way
        halfway = heading - 0.5 * self.period_s * yaw_rate
        realized = world_to_base(gained / self.period_s, halfway)
        share = self.gain * self.period_s
        return memory.estimate + share * (realized - memory.w - memory.estimate)

    def command(
        self, u_o: Array, estimate: Array, velocity_b: Array, heading: Array
    ) -> ObserverMemory:
        """Return the memory whose ``w`` is what to ask for: u_o − d within the limits, (n, 3)."""
        wished = np.clip(u_o - estimate, -self.w_limit, self.w_limit)
        return ObserverMemory(
            estimate=estimate,
            w=limit_speed(wished, velocity_b, self.max_speed_m_s, self.period_s),
            velocity=base_to_world(velocity_b, heading),
        )


def weight_disturbance(robot: RobotParams, beam: BeamParams, pitch: Array, force_b: Array) -> Array:
    """Return what a wrongly believed weight does to the grasp under Eq. (28), (n, 3) m/s².

    Without it an arm that believes in another weight drops or lifts the object before the observer
    has seen anything: at rest w = 0 gives (𝓜 + m̃_o11) ẍ_a = (m̂_o − m_o) g upwards. Across the
    direction in which it swings an object shows its whole mass.

    Args:
        robot: as believed.
        beam: as believed.
        pitch: α of the arm, (n, 2) rad.
        force_b: the force on the object at rest as read, (n, 3) N.
    """
    shown = task_inertia(robot, pitch)
    shown[:, 2, 2] += force_b[:, 2] / GRAVITY_M_S2
    missing = np.zeros_like(force_b)
    missing[:, 2] = beam.mass_kg * GRAVITY_M_S2 - force_b[:, 2]
    return np.asarray(np.linalg.solve(shown, missing[..., None])[..., 0], dtype=np.float64)
