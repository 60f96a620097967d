"""Commands within a certificate, period by period, and how well the motion follows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.certified_command import certified_command
from defmanip_gym.theory.dynamics.frames import base_to_world
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class GraspMotion:
    """What the wrapper looks at; n episodes.

    Attributes:
        velocity_b: of the grasp, (n, 3) m/s, base frame.
        heading: θ − θ_goal, (n,) rad.
        base_velocity: (u1, u2), (n, 2) m/s, rad/s.
        joints: q_a, (n, 2) rad.
    """

    velocity_b: Array
    heading: Array
    base_velocity: Array
    joints: Array

    @classmethod
    def observed(cls, layout: ObservationLayout, observation: Array) -> GraspMotion:
        """Return the motion that observations (n, size) tell of, as copies."""
        sine, cosine = layout.part(observation, "heading").T
        return cls(
            velocity_b=layout.part(observation, "grasp_velocity_b").copy(),
            heading=np.arctan2(sine, cosine),
            base_velocity=layout.part(observation, "base_velocity").copy(),
            joints=layout.part(observation, "joints").copy(),
        )

    @property
    def yaw_rate(self) -> Array:
        """u2, (n,) rad/s."""
        rate: Array = self.base_velocity[:, 1]
        return rate

    def turned_from(self, before: GraspMotion) -> Array:
        """Return this velocity in the base frame that there was before, (n, 3) m/s."""
        return base_to_world(self.velocity_b, self.heading - before.heading)


class CertifiedMotion:
    """Keeps the commands of n episodes within a certificate.

    What the last period's mean acceleration exceeded its command by is taken off the next command,
    so that only what changes from one period to the next remains an error: the surprise.

    Args:
        config: the environment's definition.
        certificate: the bounds to enforce.
        count: n.
    """

    remembers = ("excess",)

    def __init__(self, config: TransportConfig, certificate: Certificate, count: int) -> None:
        self._task, self._certificate = config.task, certificate
        self._kinematics = ArmKinematics(config.robot)
        self.excess = np.zeros((count, 3))  # of the last period, m/s²
        self._before: GraspMotion
        self._command = np.zeros((count, 3))

    def begin(self, started: BoolArray) -> None:
        """Let episodes start, (n,): nothing is known of their past."""
        self.excess[started] = 0.0

    def certified(self, w: Array, motion: GraspMotion) -> Array:
        """Return the commands nearest to w, (n, 3) m/s², that the certificate allows now."""
        limit = self._task.max_acceleration_m_s2
        command = certified_command(
            w,
            motion.velocity_b,
            motion.base_velocity,
            self._kinematics.reach_and_height(motion.joints @ JOINT_TO_PITCH.T)[:, 0],
            self._certificate,
            disturbance=self.excess,
            max_speed=self._task.max_speed_m_s,
            period_s=self._task.control_period_s,
        )
        self._before, self._command = motion, np.clip(command, -limit, limit)
        return self._command

    def conclude(self, motion: GraspMotion) -> Array:
        """Take note of the motion at the end of the period; return the surprises, (n, 3) m/s²."""
        before = self._before
        earlier = base_to_world(before.velocity_b, before.heading - motion.heading)
        gained = (motion.velocity_b - earlier) / self._task.control_period_s
        excess = gained - self._command
        surprise = excess - self.excess
        self.excess = excess
        return surprise
