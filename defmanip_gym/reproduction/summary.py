"""The slow transport in numbers."""

from __future__ import annotations

import math

import numpy as np

from defmanip_gym.reproduction.course import (
    FORCE_ERROR,
    JOINTS,
    POSE,
    POSITION,
    SWING,
    VELOCITY,
    WINDOW_S,
    Course,
)
from defmanip_gym.reproduction.parts import Numbers
from defmanip_gym.reproduction.setting import LoopStage, PaperSetting
from defmanip_gym.theory.control.stability import SampledLoop, smallest_k2
from defmanip_gym.theory.control.velocity_field import potential_gradient
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH

_PATH_STEP_M = 0.005
_GOAL_RADIUS_M = 0.05
_SETTLED_S = 1.0  # the force loop is through with the bias by then


def summarize(setting: PaperSetting, course: Course) -> Numbers:
    """Return what table and page tell about the slow transport."""
    goal, last = setting.environment.task.goal, course.last[-1]
    return {
        "nu_max": setting.nu_max,
        "speed_bound_m_s": setting.speed_bound,
        "field_speed_m_s": setting.field_speed,
        "tracking_gain_per_s": setting.tracking_gain,
        "approach_rate_per_s": setting.approach_rate,
        "force_law_damping": setting.force_law_damping,
        "physics_period_s": setting.environment.task.physics_period_s,
        "stages": [_stage(setting, stage) for stage in setting.stages],
        "smallest_k2_prop_v1": smallest_k2(setting.tracking_gain),
        "duration_s": float(course.time_s[-1]),
        "converged": _distance(last) < _GOAL_RADIUS_M,
        "largest_swing_rad": float(course.largest_swing_rad[0]),
        "sigma_rad": setting.environment.sigma_rad,
        "largest_velocity_m_s": course.largest_velocity_m_s.tolist(),
        "arrival_m": setting.arrival_m,
        "arrival_speed_m_s": setting.arrival_speed_m_s,
        "arrival_window_s": WINDOW_S,
        "final_position_m": last[POSITION].tolist(),
        "final_distance_m": _distance(last),
        "final_speed_m_s": float(np.linalg.norm(last[VELOCITY])),
        "final_heading_rad": float(last[POSE][2] - goal[2]),
        "final_joints_rad": (last[JOINTS] - goal[3:5]).tolist(),
        "final_swing_rad": float(last[SWING][0]),
        "force_error": _force_error(course),
        "literal_field_s": literal_field_duration(setting, course.opening[0, POSITION]),
    }


def literal_field_duration(setting: PaperSetting, start: Array) -> float:
    """Return how long −k ∇φ takes along its streamline to within 5 cm, s.

    k is the largest that keeps the speed within ν_max / 2: near the goal ‖∇φ‖ is 1 in the plane.
    """
    k = setting.speed_bound
    position, duration = np.array([*start[:2], 0.0]), 0.0
    while np.hypot(position[0], position[1]) > _GOAL_RADIUS_M:
        gradient = potential_gradient(position)
        slope = float(np.hypot(gradient[0], gradient[1]))
        position = position - _PATH_STEP_M * gradient / slope
        duration += _PATH_STEP_M / (k * slope)
    return duration


def sampled_loop(setting: PaperSetting, stage: LoopStage) -> SampledLoop:
    """Return the linearized loop of a stage."""
    config = setting.environment
    return SampledLoop(
        robot=config.robot,
        goal_pitch=JOINT_TO_PITCH @ np.array(config.task.goal[3:5]),
        beam=config.beam,
        linearization_beam=config.believed_beam,
        force_law_damping=setting.force_law_damping,
        gains=stage.gains,
        tracking_gain=setting.tracking_gain,
        approach_rate=setting.approach_rate,
        period_s=stage.period_s,
    )


def _stage(setting: PaperSetting, stage: LoopStage) -> Numbers:
    return {
        "period_s": stage.period_s,
        "outer_period_s": stage.period_s * stage.samples_per_update,
        "k1": stage.gains.k1,
        "k2_per_s": stage.gains.k2,
        "until_s": None if math.isinf(stage.end_s) else stage.end_s,
        "spectral_radius": sampled_loop(setting, stage).spectral_radius(),
    }


def _force_error(course: Course) -> Numbers:
    """Return the size of Δu_o at first, after a second, and at the end, (3,) m/s² each."""
    settled = course.opening_time_s >= _SETTLED_S
    opening = course.opening[:, FORCE_ERROR]
    rest = opening[settled] if settled.any() else opening[-1:]
    return {
        "first_peak_m_s2": np.abs(opening).max(axis=0).tolist(),
        "largest_after_1_s_m_s2": np.abs(rest).max(axis=0).tolist(),
        "final_rms_m_s2": np.sqrt(course.power[-1, FORCE_ERROR]).tolist(),
    }


def _distance(sample: Array) -> float:
    return float(np.linalg.norm(sample[POSITION]))
