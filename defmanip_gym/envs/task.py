"""Success, cost and reward of the transport task as pure functions of one episode's state."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import NamedTuple

from defmanip_gym.compiled import compilable
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.control.time_to_go import Motion, Mover, time_to_go

# What the expected time takes for granted: what ``field`` needs, which was tuned (docs/training.md)
_USUAL_SHARE = 2 / 3  # of the largest acceleration
_TURN_RADIUS_M = 2.6
_TURN_RATE_RAD_S = 1.1
_YAW_RATE_RAD_S = 2.0
_TURN_SHARE = 0.7
_VERTICAL_SHARE = 1.0
_SETTLED_RAD = 0.03
_SWING_RAD_PER_M = 0.4


class TaskState(NamedTuple):
    """What the task looks at.

    Attributes:
        distance_m: grasp to goal.
        height_error_m: of the grasp.
        speed_m_s: of the grasp.
        heading_error_rad: θ − θ_goal wrapped to (−π, π].
        course_error_rad: |θ − heading of the dipole streamline through the grasp|, blended into
            |θ − θ_goal| at the goal.
        largest_swing_rad: ‖z2‖∞.
        largest_swing_rate_rad_s: ‖ż2‖∞.
        motion: of the grasp.
    """

    distance_m: float
    height_error_m: float
    speed_m_s: float
    heading_error_rad: float
    course_error_rad: float
    largest_swing_rad: float
    largest_swing_rate_rad_s: float
    motion: Motion


class Outcome(NamedTuple):
    """How a step ended."""

    success: bool
    left_workspace: bool
    simulation_failed: bool


class Potentials(NamedTuple):
    """The shaping potentials, by the reward term that the difference of each makes."""

    distance: float
    course: float
    closeness: float
    time_to_go: float


class RewardTerms(NamedTuple):
    """What the reward is the sum of."""

    reward_distance: float
    reward_course: float
    reward_closeness: float
    reward_time_to_go: float
    reward_time: float
    reward_effort: float
    reward_success: float
    reward_failure: float
    reward_deformation: float


class RewardWeights(NamedTuple):
    """``RewardParams`` for compiled code."""

    distance_weight_per_m: float
    course_weight_per_rad: float
    closeness_weight: float
    approach_speed_per_m: float
    approach_swing_rad_per_m: float
    time_to_go_weight_per_s: float
    swing_cost_s_per_rad: float
    time_cost_per_step: float
    effort_weight: float
    success_bonus: float
    failure_penalty: float
    deformation_penalty: float


class Task(NamedTuple):
    """The task's constants for compiled code; see ``TaskParams`` and ``TransportConfig``."""

    position_tolerance_m: float
    speed_tolerance_m_s: float
    swing_tolerance_rad: float
    heading_tolerance_rad: float
    max_speed_m_s: float
    sigma_rad: float
    swing_frequency_rad_s: float
    mover: Mover
    violation_ends: bool
    excess_is_penalized: bool
    weights: RewardWeights


def task_of(config: TransportConfig) -> Task:
    """Return the constants of an environment's task."""
    task = config.task
    return Task(
        position_tolerance_m=task.position_tolerance_m,
        speed_tolerance_m_s=task.speed_tolerance_m_s,
        swing_tolerance_rad=task.swing_tolerance_rad,
        heading_tolerance_rad=task.heading_tolerance_rad,
        max_speed_m_s=task.max_speed_m_s,
        sigma_rad=config.sigma_rad,
        swing_frequency_rad_s=config.payload.slowest_rad_s,
        mover=_mover_of(config),
        violation_ends=config.constraint_mode == "terminate",
        excess_is_penalized=config.constraint_mode == "penalty",
        weights=RewardWeights(**asdict(task.reward)),
    )


def _mover_of(config: TransportConfig) -> Mover:
    """Return what the reward takes the robot to be able to do."""
    task = config.task
    return Mover(
        acceleration_m_s2=_USUAL_SHARE * task.max_acceleration_m_s2,
        speed_m_s=task.max_speed_m_s,
        turn_radius_m=_TURN_RADIUS_M,
        turn_rate_rad_s=_TURN_RATE_RAD_S,
        yaw_rate_rad_s=_YAW_RATE_RAD_S,
        reach_m=config.goal_reach_and_height_m[0],
        turn_share=_TURN_SHARE,
        vertical_share=_VERTICAL_SHARE,
    )


@compilable
def tolerance_shares(state: TaskState, task: Task) -> tuple[float, float, float, float]:
    """Return each error over its tolerance: distance, speed, swing, heading."""
    return (
        state.distance_m / task.position_tolerance_m,
        state.speed_m_s / task.speed_tolerance_m_s,
        state.largest_swing_rad / task.swing_tolerance_rad,
        abs(state.heading_error_rad) / task.heading_tolerance_rad,
    )


@compilable
def is_success(state: TaskState, task: Task) -> bool:
    """Whether all four errors are within their tolerances."""
    position, speed, swing, heading = tolerance_shares(state, task)
    return position < 1.0 and speed < 1.0 and swing < 1.0 and heading < 1.0


@compilable
def constraint_margin(state: TaskState, task: Task) -> float:
    """Return σ − ‖z2‖∞ in rad; negative where Eq. (9) is violated."""
    return task.sigma_rad - state.largest_swing_rad


@compilable
def potentials(state: TaskState, task: Task) -> Potentials:
    """Return the shaping potentials.

    Distance and course pull from afar, the height on its own, lest it be left for last; closeness,
    logarithmic in the distance to the goal *set* counted in tolerances, still distinguishes
    hovering near the goal from settling in it. Speed and swing that fit the way left cost nothing:
    if they did, standing still before the goal would be closer to it than moving there.
    """
    weights = task.weights
    height = abs(state.height_error_m)
    planar = math.sqrt(max(state.distance_m**2 - height**2, 0.0))
    position, speed, swing, heading = tolerance_shares(state, task)
    moving = weights.approach_speed_per_m * state.distance_m / task.speed_tolerance_m_s
    swinging = weights.approach_swing_rad_per_m * state.distance_m / task.swing_tolerance_rad
    speed, swing = max(speed - moving, 0.0), max(swing - swinging, 0.0)
    away = math.sqrt(position**2 + speed**2 + swing**2 + heading**2)
    expected = 0.0
    if weights.time_to_go_weight_per_s > 0.0 and not is_success(state, task):
        expected = weights.time_to_go_weight_per_s * expected_time(state, task)
    return Potentials(
        distance=-weights.distance_weight_per_m * (planar + height),
        course=-weights.course_weight_per_rad * state.course_error_rad,
        closeness=-weights.closeness_weight * math.log1p(away),
        time_to_go=-expected,
    )


@compilable
def expected_time(state: TaskState, task: Task) -> float:
    """Return about how long it is to the goal, s: to come to rest there, and the swing too.

    Swing that fits the way left costs nothing, as in ``potentials``.
    """
    rate = state.largest_swing_rate_rad_s / task.swing_frequency_rad_s
    amplitude = math.sqrt(state.largest_swing_rad**2 + rate**2)
    fitting = _SETTLED_RAD + _SWING_RAD_PER_M * state.distance_m
    swing = task.weights.swing_cost_s_per_rad * max(amplitude - fitting, 0.0)
    return time_to_go(state.motion, task.mover) + swing


@compilable
def is_failure(outcome: Outcome, margin_rad: float, task: Task) -> bool:
    """Whether the episode ended for a reason nobody wants."""
    violated = task.violation_ends and margin_rad < 0
    return outcome.left_workspace or outcome.simulation_failed or violated


@compilable
def reward_terms(
    before: Potentials,
    after: Potentials,
    squared_action: float,
    outcome: Outcome,
    margin_rad: float,
    task: Task,
) -> RewardTerms:
    """Return the terms whose sum is the reward.

    Args:
        before: potentials one step ago.
        after: potentials now.
        squared_action: squared norm of the normalized action.
        outcome: how the step ended.
        margin_rad: the constraint's margin.
        task: its constants.
    """
    weights = task.weights
    excess_share = max(-margin_rad, 0.0) / task.sigma_rad if task.excess_is_penalized else 0.0
    return RewardTerms(
        reward_distance=after.distance - before.distance,
        reward_course=after.course - before.course,
        reward_closeness=after.closeness - before.closeness,
        reward_time_to_go=after.time_to_go - before.time_to_go,
        reward_time=-weights.time_cost_per_step,
        reward_effort=-weights.effort_weight * squared_action,
        reward_success=weights.success_bonus if outcome.success else 0.0,
        reward_failure=-weights.failure_penalty if is_failure(outcome, margin_rad, task) else 0.0,
        reward_deformation=-weights.deformation_penalty * excess_share,
    )
