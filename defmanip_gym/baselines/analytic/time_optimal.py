"""``time_optimal``: plans the quickest motion from where an episode begins, and follows it.

The plan is the optimal control problem's answer with margins (``planning``; J. T. Betts, "Practical
Methods for Optimal Control Using Nonlinear Programming", SIAM 2010), taken from the stored ones
where the start is known, which is planning offline, and solved for where it is not. It is followed
by linear-quadratic regulation about it, and held at the goal by the same law.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.baselines.analytic.planner_state import planner_states
from defmanip_gym.baselines.analytic.sampled_law import Array, Memory, SampledLaw
from defmanip_gym.baselines.analytic.time_optimal_params import TimeOptimalParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.payloads.rod import beam_payload
from defmanip_gym.planning.following import Following
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.planning.stored import StoredPlans
from defmanip_gym.planning.tracking import holding_gain
from defmanip_gym.planning.tracks import Tracks, fitting_plans
from defmanip_gym.task_params import TaskParams
from defmanip_gym.validation import require_instance, require_params


class TimeOptimalController(SampledLaw):
    """Plans at the beginning of each episode, then follows.

    It remembers where each episode's plan begins, (n, 11), and how many samples ago, (n,). Plans
    and gains follow from that alone, and are made once for each.

    Args:
        beam: the object as the controller knows it, a rigid rod.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        sigma_rad: σ.
        params: design choices.
        plans: that are known beforehand; those of the package by default, where they were made for
            this robot, beam and task.

    Attributes:
        knows: what comparisons say that it knows beyond the observation.

    Raises:
        ParameterError: the beam has several segments, or an argument of another kind.
        GainError: the observer would be unstable with its gain.
    """

    knows = "nominal robot and beam; plans made beforehand for the suites' starts"
    params: TimeOptimalParams

    def __init__(
        self,
        *,
        beam: BeamParams | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        sigma_rad: float = math.pi / 6,
        params: TimeOptimalParams | None = None,
        plans: StoredPlans | None = None,
    ) -> None:
        given = TimeOptimalParams() if params is None else params
        params = require_params("params", given, TimeOptimalParams)
        super().__init__(payload=beam_payload(beam), robot=robot, task=task, params=params)
        self.setting = PlanningSetting(
            beam=self.beam, robot=self.robot, task=self.task, sigma_rad=sigma_rad
        )
        if plans is not None:
            require_instance("plans", plans, StoredPlans)
        self.tracks = Tracks(
            setting=self.setting,
            stored=fitting_plans(self.setting) if plans is None else plans,
            margins=params.margins,
            search=params.search,
            weights=params.weights,
        )
        period_s = self.task.control_period_s
        self.following = Following(
            tracks=self.tracks,
            hold=holding_gain(self.setting.model, period_s, params.weights),
            lost_m=params.lost_m,
            patience_samples=params.patience_s / period_s,
        )

    def begin(self, now: GraspSample) -> Memory:
        """Return where plans begin, here, and that this is their first sample."""
        return planner_states(now), np.zeros(len(now.heading), dtype=np.int64)

    def command(self, now: GraspSample, memory: Memory) -> tuple[Array, Memory]:
        """Return the plans' accelerations with feedback, (n, 3) m/s².

        Raises:
            InstallationError: a start that no stored plan is for, and CasADi is not installed.
            ParameterError: a start without plan.
        """
        states, (origins, steps) = planner_states(now), memory
        if self.params.replans:
            lost = self.following.lost(states, origins, steps)
            origins = np.where(lost[:, None], states, origins)
            steps = np.where(lost, 0, steps)
        return self.following.commands(states, origins, steps), (origins, steps + 1)

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        more = {"sigma_rad": self.setting.sigma_rad, "plans": self.tracks.stored.digest}
        return super().identity | more


def make_controller(config: TransportConfig) -> TimeOptimalController:
    """Plans the quickest motion from the start, with margins, and follows it by LQR."""
    return TimeOptimalController(
        beam=config.beam,
        robot=config.believed_robot,
        task=config.task,
        sigma_rad=config.sigma_rad,
    )
