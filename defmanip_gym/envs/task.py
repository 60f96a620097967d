"""Success, cost and reward of the transport task as pure functions of the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.params import RewardParams, TaskParams

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class TaskState:
    """What the task looks at, n episodes.

    Attributes:
        distance_m: grasp to goal, (n,).
        speed_m_s: of the grasp, (n,).
        heading_error_rad: θ − θ_goal wrapped to (−π, π], (n,).
        largest_swing_rad: ‖z2‖∞, (n,).
    """

    distance_m: Array
    speed_m_s: Array
    heading_error_rad: Array
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


def potentials(state: TaskState, task: TaskParams) -> tuple[Array, Array]:
    """Return the two shaping potentials, distance and closeness, each (n,).

    The first pulls from afar; the second, logarithmic in the distance to the goal *set* counted
    in tolerances, still distinguishes hovering near the goal from settling in it.
    """
    reward = task.reward
    away = np.sqrt((tolerance_shares(state, task) ** 2).sum(axis=0))
    return (
        -reward.distance_weight_per_m * state.distance_m,
        -reward.closeness_weight * np.log1p(away),
    )


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
    before: tuple[Array, Array],
    after: tuple[Array, Array],
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
        "reward_distance": after[0] - before[0],
        "reward_closeness": after[1] - before[1],
        "reward_time": np.full(excess_share.shape, -weights.time_cost_per_step),
        "reward_effort": -weights.effort_weight * (action**2).sum(axis=-1),
        "reward_success": weights.success_bonus * outcome.success,
        "reward_failure": -weights.failure_penalty * failure,
        "reward_deformation": -weights.deformation_penalty * excess_share,
    }
