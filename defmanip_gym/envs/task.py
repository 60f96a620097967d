"""Success, cost and reward of the transport task as pure functions of the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.params import RewardParams, TaskParams
from defmanip_gym.theory.velocity_field import streamline_heading

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class TaskState:
    """What the task looks at, n episodes.

    Attributes:
        distance_m: grasp to goal, (n,).
        height_error_m: of the grasp, (n,).
        speed_m_s: of the grasp, (n,).
        heading_error_rad: θ − θ_goal wrapped to (−π, π], (n,).
        course_error_rad: |θ − heading of the dipole streamline through the grasp|, blended into
            |θ − θ_goal| at the goal, (n,).
        largest_swing_rad: ‖z2‖∞, (n,).
    """

    distance_m: Array
    height_error_m: Array
    speed_m_s: Array
    heading_error_rad: Array
    course_error_rad: Array
    largest_swing_rad: Array


def tolerance_shares(state: TaskState, task: TaskParams) -> Array:
    """Return each error over its tolerance, (4, n): distance, speed, swing, heading."""
    return np.stack(
        (
            state.distance_m / task.position_tolerance_m,
            state.speed_m_s / task.speed_tolerance_m_s,
            state.largest_swing_rad / task.swing_tolerance_rad,
            np.abs(state.heading_error_rad) / task.heading_tolerance_rad,
        )
    )


def is_success(state: TaskState, task: TaskParams) -> BoolArray:
    """Whether all four errors are within their tolerances, (n,)."""
    return np.asarray((tolerance_shares(state, task) < 1.0).all(axis=0))


def constraint_margin(state: TaskState, sigma_rad: float) -> Array:
    """Return σ − ‖z2‖∞, (n,) rad; negative where Eq. (9) is violated."""
    return sigma_rad - state.largest_swing_rad


def wrapped(angle: Array) -> Array:
    """Return the angle in (−π, π]."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def course_error(position: Array, heading_error: Array, blend_radius_m: float) -> Array:
    """Return how far the robot is off the course that ends with the right heading, (n,) rad.

    A robot that cannot move sideways must be on the right streamline long before the goal; the
    distance alone says nothing about that.

    Args:
        position: grasp relative to the goal in axes of the goal's heading, (n, 2) m.
        heading_error: θ − θ_goal, (n,) rad.
        blend_radius_m: distance at which streamline and goal heading weigh the same.
    """
    squared = (position**2).sum(axis=1)
    share = squared / (squared + blend_radius_m**2)
    return np.abs(wrapped(heading_error - share * wrapped(streamline_heading(position))))


def potentials(state: TaskState, task: TaskParams) -> dict[str, Array]:
    """Return the shaping potentials, (n,) each, by the reward term that each one makes.

    Distance and course pull from afar, the height on its own, lest it be left for last; closeness,
    logarithmic in the distance to the goal *set* counted in tolerances, still distinguishes
    hovering near the goal from settling in it.
    """
    reward = task.reward
    height = np.abs(state.height_error_m)
    planar = np.sqrt(np.maximum(state.distance_m**2 - height**2, 0.0))
    away = np.sqrt((tolerance_shares(state, task) ** 2).sum(axis=0))
    return {
        "reward_distance": -reward.distance_weight_per_m * (planar + height),
        "reward_course": -reward.course_weight_per_rad * state.course_error_rad,
        "reward_closeness": -reward.closeness_weight * np.log1p(away),
    }


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a step ended, each (n,) bool."""

    success: BoolArray
    violation: BoolArray
    left_workspace: BoolArray
    simulation_failed: BoolArray

    @property
    def failure(self) -> BoolArray:
        """Ended for a reason nobody wants."""
        return self.left_workspace | self.simulation_failed


def reward_terms(
    *,
    before: dict[str, Array],
    after: dict[str, Array],
    action: Array,
    outcome: Outcome,
    violation_ends: bool,
    excess_share: Array,
    weights: RewardParams,
) -> dict[str, Array]:
    """Return the terms whose sum is the reward, each (n,).

    Args:
        before: potentials one step ago.
        after: potentials now.
        action: normalized action, (n, k).
        outcome: how the step ended.
        violation_ends: whether violating σ terminates the episode.
        excess_share: max(0, ‖z2‖∞/σ − 1) where it is penalized, else zero, (n,).
        weights: reward weights.
    """
    failure = outcome.failure | outcome.violation if violation_ends else outcome.failure
    return {
        **{name: after[name] - before[name] for name in after},
        "reward_time": np.full(excess_share.shape, -weights.time_cost_per_step),
        "reward_effort": -weights.effort_weight * (action**2).sum(axis=-1),
        "reward_success": weights.success_bonus * outcome.success,
        "reward_failure": -weights.failure_penalty * failure,
        "reward_deformation": -weights.deformation_penalty * excess_share,
    }
