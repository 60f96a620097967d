"""Records and traces made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.traces import Trace

SIGMA_RAD = 0.5

_RECORD = EpisodeRecord(
    suite="nominal",
    scenario="nominal-00",
    condition="nominal",
    contestant="a",
    family="analytic",
    member="-",
    seed=1_000_000,
    start=(-8.5, 5.5, 0.0, 1.0, -1.5, 0.0),
    outcome="success",
    success=True,
    violated=False,
    largest_swing_share=0.25,
    time_to_goal_s=10.0,
    duration_s=10.0,
    start_distance_m=10.0,
    final_distance_m=0.05,
    speed_limit_m_s=2.0,
    peak_grasp_force_n=31.0,
    force_error_n=0.1,
    energy_j=12.0,
    path_length_m=10.5,
    interventions=None,
    mean_intervention_m_s2=None,
    largest_correction_m_s2=None,
    correction_reversals_per_s=None,
    certificate_applies=None,
    return_=20.0,
)


def record(**changes: object) -> EpisodeRecord:
    return replace(_RECORD, **changes)


def trace(
    contestant: str,
    scenario: str,
    duration_s: float,
    *,
    suite: str = "nominal",
    member: str = "-",
) -> Trace:
    time_s = np.append(np.arange(0.0, duration_s, 0.04), duration_s)
    swing = 0.2 * np.sin(5.0 * time_s)
    position = np.outer(1.0 - time_s / duration_s, (-8.0, 5.0, -0.4))
    heading = 0.1 * swing
    return Trace(
        suite=suite,
        contestant=contestant,
        member=member,
        scenario=scenario,
        time_s=time_s,
        largest_swing_rad=np.abs(swing),
        swing_rad=swing[:, None],
        swing_rate_rad_s=np.cos(5.0 * time_s)[:, None],
        margin_rad=SIGMA_RAD - np.abs(swing),
        position_m=position,
        heading_rad=heading,
        base_pose=np.column_stack((position[:, :2], heading)),
        joints_rad=np.tile((1.2, -1.5), (len(time_s), 1)),
        requested_m_s2=np.zeros((len(time_s), 3)),
        action_m_s2=np.zeros((len(time_s), 3)),
    )
