"""The paper's controller near the goal, as a sampled loop with a given beam."""

from __future__ import annotations

import numpy as np

from defmanip_gym.baselines.analytic.tanner_params import TannerParams
from defmanip_gym.errors import GainError
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.stability import SampledLoop
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH


def tanner_loop(
    params: TannerParams,
    *,
    beam: BeamParams,
    linearization_beam: BeamParams,
    robot: RobotParams,
    task: TaskParams,
) -> SampledLoop:
    """Return the loop, if robot and beam are as the controller knows them.

    Args:
        params: gains.
        beam: that is carried.
        linearization_beam: what the environment's inner loop believes to carry.
        robot: that carries it.
        task: goal and control period.
    """
    return SampledLoop(
        robot=robot,
        goal_pitch=JOINT_TO_PITCH @ np.array(task.goal[3:5]),
        beam=beam,
        linearization_beam=linearization_beam,
        force_law_damping=params.force_law_damping,
        gains=params.gains,
        tracking_gain=params.tracking_gain,
        approach_rate=params.approach_rate,
        period_s=task.control_period_s,
        feedforward=params.feedforward,
    )


def require_stable(loop: SampledLoop) -> None:
    """Raise GainError unless the loop is stable."""
    radius = loop.spectral_radius()
    if radius >= 1.0:
        raise GainError(
            "(k1, k2, force_law_damping)",
            (loop.gains.k1, loop.gains.k2, loop.force_law_damping),
            f"gains with a spectral radius below 1 over a sample (here {radius:.5f})",
            "Take gains_for(beam), lower k1 or k2, or assume less damping in the force law.",
        )
