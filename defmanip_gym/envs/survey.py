"""What an episode's plant state means for the task, and what its sensors report."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.task import TaskState
from defmanip_gym.observation import NEAR_OFFSET_SCALE_M, ObservationLayout
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.theory.control.time_to_go import Motion
from defmanip_gym.theory.control.velocity_field import streamline_heading
from defmanip_gym.theory.dynamics.frames import turned, wrapped
from defmanip_gym.theory.dynamics.robot_model import ArmLengths, grasp_velocity, reach_and_height

Array = NDArray[np.float64]


class Goal(NamedTuple):
    """Where the grasp is to go, world frame, and the arm that takes it there.

    ``course_blend_radius_m`` is the distance at which streamline and goal heading weigh the same.
    """

    x_m: float
    y_m: float
    z_m: float
    heading_rad: float
    course_blend_radius_m: float
    arm: ArmLengths


def goal_of(config: TransportConfig) -> Goal:
    """Return the goal of an environment."""
    return Goal(
        *config.goal_position_m,
        heading_rad=float(config.task.goal[2]),
        course_blend_radius_m=float(config.task.course_blend_radius_m),
        arm=ArmLengths.of(config.robot),
    )


@compilable
def course_error(x: float, y: float, heading_error: float, blend_radius_m: float) -> float:
    """Return how far the robot is off the course that ends with the right heading, rad.

    A robot that cannot move sideways must be on the right streamline long before the goal; the
    distance alone says nothing about that.

    Args:
        x: grasp relative to the goal, along the goal's heading, m.
        y: and to its left, m.
        heading_error: θ − θ_goal, rad.
        blend_radius_m: see ``Goal``.
    """
    squared = x**2 + y**2
    share = squared / (squared + blend_radius_m**2)
    return abs(wrapped(heading_error - share * wrapped(streamline_heading(x, y))))


@compilable
def survey(goal: Goal, plant: PlantState, i: int, observations: Array) -> TaskState:
    """Write an episode's observation without sensor noise and return what the task looks at.

    Args:
        goal: of the task.
        plant: the true state of n episodes.
        i: which of them.
        observations: (n, size), in the order of ``ObservationLayout``.
    """
    heading, upper = plant.base_pose[i, 2], plant.joints[i, 0]
    u1, u2 = plant.base_velocity[i, 0], plant.base_velocity[i, 1]
    fore = upper + plant.joints[i, 1]
    upper_rate = plant.joint_rates[i, 0]
    fore_rate = upper_rate + plant.joint_rates[i, 1]

    reach, height = reach_and_height(goal.arm, upper, fore)
    forward, left, up = grasp_velocity(goal.arm, upper, fore, upper_rate, fore_rate, u1, u2)

    ahead, aside = turned(
        goal.x_m - plant.base_pose[i, 0], goal.y_m - plant.base_pose[i, 1], -heading
    )
    ahead, above = ahead - reach, goal.z_m - height
    heading_error = wrapped(heading - goal.heading_rad)
    x, y = turned(-ahead, -aside, heading_error)

    observations[i, 0], observations[i, 1], observations[i, 2] = ahead, aside, above
    observations[i, 3], observations[i, 4] = math.sin(heading_error), math.cos(heading_error)
    observations[i, 5], observations[i, 6], observations[i, 7] = forward, left, up
    observations[i, 8], observations[i, 9] = u1, u2
    largest_swing, largest_rate = 0.0, 0.0
    _, segments = plant.swing.shape
    for k in range(2):
        observations[i, 10 + k] = plant.joints[i, k]
        observations[i, 12 + k] = plant.joint_rates[i, k]
    for k in range(segments):
        observations[i, 14 + k] = plant.swing[i, k]
        observations[i, 14 + segments + k] = plant.swing_rate[i, k]
        largest_swing = max(largest_swing, abs(plant.swing[i, k]))
        largest_rate = max(largest_rate, abs(plant.swing_rate[i, k]))
    for k in range(3):
        observations[i, 14 + 2 * segments + k] = plant.grasp_force_b[i, k]
        observations[i, 17 + 2 * segments + k] = math.tanh(observations[i, k] / NEAR_OFFSET_SCALE_M)

    return TaskState(
        distance_m=math.sqrt(ahead**2 + aside**2 + above**2),
        height_error_m=above,
        speed_m_s=math.sqrt(forward**2 + left**2 + up**2),
        heading_error_rad=heading_error,
        course_error_rad=course_error(x, y, heading_error, goal.course_blend_radius_m),
        largest_swing_rad=largest_swing,
        largest_swing_rate_rad_s=largest_rate,
        motion=Motion(x, y, -above, heading_error, forward, up, u2),
    )


@compiled
def _observations(goal: Goal, plant: PlantState, observations: Array) -> None:
    for i in range(len(observations)):
        survey(goal, plant, i, observations)


def clean_observations(config: TransportConfig, plant: PlantState) -> Array:
    """Return what noiseless sensors report of n plants, (n, size)."""
    count, segments = plant.swing.shape
    observations = np.empty((count, ObservationLayout(segments).size))
    _observations(goal_of(config), plant, observations)
    return observations
