"""From an episode's course to its record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM
from defmanip_gym.evaluation.course import Course
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.readings import position_from_goal
from defmanip_gym.evaluation.records import EpisodeRecord, Outcome
from defmanip_gym.evaluation.suites import Scenario
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.control_laws import limit_speed
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.wrappers.filtering import ROUNDING_M_S2

Array = NDArray[np.float64]


def episode_record(
    course: Course,
    entry: Entry,
    scenario: Scenario,
    config: TransportConfig,
    *,
    nominal_beam: BeamParams = NOMINAL_BEAM,
) -> EpisodeRecord:
    """Return the record of an episode.

    Args:
        course: what happened.
        entry: who controlled it, in which suite.
        scenario: where it started.
        config: the environment's definition.
        nominal_beam: whose force (10) the measured one is held against.
    """
    layout = ObservationLayout(config.beam.segment_count)
    task, sigma_rad = config.task, config.sigma_rad
    steps = len(course.reward)
    duration_s = round(steps * task.control_period_s, 9)
    force = layout.part(course.observation, "grasp_force_b")
    velocity = layout.part(course.observation, "grasp_velocity_b")
    power = np.abs((force * velocity).sum(axis=1))
    path = np.diff(position_from_goal(course.observation, layout), axis=0)
    largest_swing = float(sigma_rad - course.margin_rad.min())
    violated = largest_swing > sigma_rad
    outcome = _outcome(course, violated)
    return EpisodeRecord(
        suite=entry.suite,
        scenario=scenario.name,
        condition=scenario.condition.name,
        contestant=entry.contestant,
        family=entry.family,
        member=entry.member,
        seed=scenario.seed,
        start=scenario.start,
        outcome=outcome,
        success=outcome == "success",
        violated=violated,
        largest_swing_share=largest_swing / sigma_rad,
        time_to_goal_s=duration_s if course.reached_goal else None,
        duration_s=duration_s,
        start_distance_m=float(course.distance_m[0]),
        final_distance_m=float(course.distance_m[-1]),
        speed_limit_m_s=task.max_speed_m_s,
        peak_grasp_force_n=float(_norm(force).max()),
        force_error_n=_force_error(course, layout, config, nominal_beam),
        energy_j=float(power[1:].sum() * task.control_period_s),
        path_length_m=float(_norm(path).sum()),
        interventions=_mean(course.intervened),
        mean_intervention_m_s2=_mean(course.intervention_m_s2),
        largest_correction_m_s2=_largest(course.intervention_m_s2),
        correction_reversals_per_s=_reversal_rate(course.forward_correction_m_s2, duration_s),
        certificate_applies=course.certificate_applies,
        return_=float(course.reward.sum()),
    )


def _outcome(course: Course, violated: bool) -> Outcome:
    """Return the gravest thing that happened; failed physics make the rest meaningless."""
    if course.simulation_failed:
        return "simulation_failed"
    if violated:
        return "violation"
    if course.reached_goal:
        return "success"
    return "left_workspace" if course.left_workspace else "timeout"


def _force_error(
    course: Course, layout: ObservationLayout, config: TransportConfig, beam: BeamParams
) -> float:
    """Return the RMS of measured force minus Eq. (10), at the ends of periods, N.

    A force is read under the command of the period that it ends; the environment's speed limit
    belongs to that command.
    """
    task = config.task
    velocity = layout.part(course.observation, "grasp_velocity_b")
    w = course.applied * task.max_acceleration_m_s2
    w = limit_speed(w, velocity[:-1], task.max_speed_m_s, task.control_period_s)
    expected = HangingBeam(beam).linearizing_force(
        course.swing_rad[1:],
        course.swing_rate_rad_s[1:],
        layout.part(course.observation[1:], "base_velocity")[:, 1],
        w,
    )
    error = layout.part(course.observation[1:], "grasp_force_b") - expected
    return float(np.sqrt((error**2).sum(axis=1).mean()))


def _norm(vectors: Array) -> Array:
    return np.asarray(np.sqrt((vectors**2).sum(axis=1)))


def _mean(values: Array | None) -> float | None:
    return None if values is None else float(values.mean())


def _largest(values: Array | None) -> float | None:
    return None if values is None else float(values.max())


def _reversal_rate(corrections: Array | None, duration_s: float) -> float | None:
    """Return how often a second a correction has another sign than the last one had."""
    if corrections is None:
        return None
    signs = np.sign(corrections[np.abs(corrections) > ROUNDING_M_S2])
    return float(np.count_nonzero(np.diff(signs)) / duration_s)
