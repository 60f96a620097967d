"""What analytic controllers look at: the grasp and the object in one sample, from observations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.dynamics.frames import base_to_world
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class GraspSample:
    """Grasp and object in one sample; n episodes, N segments.

    Attributes:
        position: of the grasp from the goal in axes of the goal's heading, (n, 3) m.
        heading: θ − θ_goal, (n,) rad.
        velocity_b: ż1 in the base frame, (n, 3) m/s.
        yaw_rate: u2, (n,) rad/s.
        reach: ρ, (n,) m.
        reach_rate: ρ̇, (n,) m/s: what the grasp has forward of the base's velocity.
        swing: φ, (n, N) rad.
        swing_rate: φ̇, (n, N) rad/s.
        force_b: f̃, the measured force on the object in the base frame, (n, 3) N.
    """

    position: Array
    heading: Array
    velocity_b: Array
    yaw_rate: Array
    reach: Array
    reach_rate: Array
    swing: Array
    swing_rate: Array
    force_b: Array


def grasp_sample(
    observation: Array, layout: ObservationLayout, kinematics: ArmKinematics
) -> GraspSample:
    """Read observations.

    Args:
        observation: (n, size).
        layout: of the beam carried.
        kinematics: of the arm that carries it.
    """

    def part(name: str) -> Array:
        return layout.part(observation, name)

    heading = np.arctan2(part("heading")[:, 0], part("heading")[:, 1])
    pitch = part("joints") @ JOINT_TO_PITCH.T
    velocity_b = part("grasp_velocity_b")
    return GraspSample(
        position=base_to_world(-part("goal_offset_b"), heading),
        heading=heading,
        velocity_b=velocity_b,
        yaw_rate=part("base_velocity")[:, 1],
        reach=kinematics.reach_and_height(pitch)[:, 0],
        reach_rate=velocity_b[:, 0] - part("base_velocity")[:, 0],
        swing=part("swing"),
        swing_rate=part("swing_rate"),
        force_b=part("grasp_force_b"),
    )
