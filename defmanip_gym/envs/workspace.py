"""The region in which the robot can work; leaving it ends an episode."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import Numbers, compilable
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.dynamics.robot_model import ArmLengths, reach_and_height

Array = NDArray[np.float64]


class Workspace(NamedTuple):
    """Where the robot may be; see ``TaskParams`` (compiled code takes named tuples)."""

    arm: ArmLengths
    center_x_m: float
    center_y_m: float
    arena_radius_m: float
    smallest_elbow_bend_rad: float
    smallest_reach_m: float
    smallest_grasp_height_m: float


def workspace_of(config: TransportConfig) -> Workspace:
    """Return the workspace of an environment.

    Raises:
        ParameterError: the goal is not in it.
    """
    task = config.task
    space = Workspace(
        arm=ArmLengths.of(config.robot),
        center_x_m=task.goal[0],
        center_y_m=task.goal[1],
        arena_radius_m=task.arena_radius_m,
        smallest_elbow_bend_rad=task.smallest_elbow_bend_rad,
        smallest_reach_m=task.smallest_reach_m,
        smallest_grasp_height_m=task.smallest_grasp_height_m,
    )
    goal = np.array(task.goal)
    if not in_workspace(goal[0], goal[1], goal[3], goal[3] + goal[4], space):
        raise ParameterError(
            "task.goal",
            task.goal,
            "a pose with the elbow bent (-π < q2 < 0), the grasp in front and above the floor",
            "Choose one that the robot can take, or another robot.",
        )
    return space


@compilable
def in_workspace(
    x: Numbers, y: Numbers, upper: Numbers, fore: Numbers, space: Workspace
) -> Numbers:
    """Whether the base is in the arena and the arm clear of its singularities, (...).

    Args:
        x: of the base, (...) m.
        y: likewise.
        upper: α1, (...) rad.
        fore: α2, (...) rad; the elbow must point up, −π < α2 − α1 < 0.
        space: the workspace.
    """
    reach, height = reach_and_height(space.arm, upper, fore)
    elbow, bend = fore - upper, space.smallest_elbow_bend_rad
    return (
        (np.hypot(x - space.center_x_m, y - space.center_y_m) < space.arena_radius_m)
        & (elbow < -bend)
        & (elbow > bend - math.pi)
        & (reach > space.smallest_reach_m)
        & (height > space.smallest_grasp_height_m)
    )
