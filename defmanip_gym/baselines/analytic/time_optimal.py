"""Plans the quickest motion from where an episode begins, and follows it.

The plan is the optimal control problem's answer with margins (``planning``), taken from the stored
ones where the start is known, which is planning offline, and solved for where it is not. It is
followed by linear-quadratic regulation about it, and held at the goal by the same law.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.planner_state import planner_states
from defmanip_gym.baselines.analytic.time_optimal_params import TimeOptimalParams
from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.config import InnerLoopKind, TransportConfig
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.planning.following import Following
from defmanip_gym.planning.model import HEADING, REACH, VELOCITY, Array
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.planning.stored import StoredPlans
from defmanip_gym.planning.tracking import holding_gain
from defmanip_gym.planning.tracks import Tracks, fitting_plans
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.disturbance_observer import (
    DisturbanceObserver,
    ObserverMemory,
    weight_disturbance,
)
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import require_instance, require_params

BoolArray = NDArray[np.bool_]


class TimeOptimalController:
    """Plans at the beginning of each episode, then follows.

    Its state holds where each episode's plan begins, (n, 11), and how many samples ago, (n,). Plans
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
        self.setting = PlanningSetting(
            beam=BeamParams() if beam is None else beam,
            robot=RobotParams() if robot is None else robot,
            task=TaskParams() if task is None else task,
            sigma_rad=sigma_rad,
        )
        given = TimeOptimalParams() if params is None else params
        self.params = params = require_params("params", given, TimeOptimalParams)
        if plans is not None:
            require_instance("plans", plans, StoredPlans)
        self.tracks = Tracks(
            setting=self.setting,
            stored=fitting_plans(self.setting) if plans is None else plans,
            margins=params.margins,
            search=params.search,
            weights=params.weights,
        )
        self.layout = ObservationLayout(1)
        self.kinematics = ArmKinematics(self.setting.robot)
        period_s = self.setting.task.control_period_s
        self._observer = DisturbanceObserver(
            gain=params.observer_gain_per_s,
            period_s=period_s,
            w_limit=self.setting.task.max_acceleration_m_s2,
            max_speed_m_s=self.setting.task.max_speed_m_s,
        )
        self.following = Following(
            tracks=self.tracks,
            hold=holding_gain(self.setting.model, period_s, params.weights),
            lost_m=params.lost_m,
            patience_samples=params.patience_s / period_s,
        )

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return w / a_max and (where plans begin, samples since then, the observer's memory).

        Raises:
            InstallationError: a start that no stored plan is for, and CasADi is not installed.
            ParameterError: a start without plan.
        """
        batch = np.atleast_2d(observation)
        states = planner_states(batch, self.layout, self.kinematics)
        origins, steps = states, np.zeros(len(states), dtype=np.int64)
        disturbance = self._first_disturbance(batch)
        if state is not None:
            goes_on = np.ones(len(states), dtype=bool)
            if episode_start is not None:
                goes_on = ~np.atleast_1d(episode_start)
            origins = np.where(goes_on[:, None], state[0], states)
            steps = np.where(goes_on, state[1], 0)
            memory = ObserverMemory(estimate=state[2], w=state[3], velocity=state[4])
            observed = self._observed(states, memory)
            disturbance = np.where(goes_on[:, None], observed, disturbance)
        if self.params.replans:
            lost = self.following.lost(states, origins, steps)
            origins = np.where(lost[:, None], states, origins)
            steps = np.where(lost, 0, steps)
        memory = self._observer.command(
            self.following.commands(states, origins, steps),
            disturbance,
            states[:, VELOCITY],
            states[:, HEADING],
        )
        action = np.clip(memory.w / self.setting.task.max_acceleration_m_s2, -1.0, 1.0)
        remembered = (origins, steps + 1, memory.estimate, memory.w, memory.velocity)
        return action.reshape(*np.shape(observation)[:-1], 3), remembered

    @property
    def inner_loop(self) -> InnerLoopKind:
        """The inner loop that the environment is to have."""
        return self.params.inner_loop

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        return {
            "setting": asdict(self.setting),
            "params": asdict(self.params),
            "plans": self.tracks.stored.digest,
        }

    def _first_disturbance(self, batch: Array) -> Array:
        """Return what is expected before anything was observed, (n, 3) m/s²."""
        if self.params.inner_loop == "measured_force":
            return np.zeros((len(batch), 3))
        pitch = self.layout.part(batch, "joints") @ JOINT_TO_PITCH.T
        force = self.layout.part(batch, "grasp_force_b")
        return weight_disturbance(self.setting.robot, self.setting.beam, pitch, force)

    def _observed(self, states: Array, memory: ObserverMemory) -> Array:
        """Return the observer's estimate of this sample, (n, 3) m/s²."""
        yaw_rate = states[:, VELOCITY][:, 1] / states[:, REACH]
        return self._observer.updated(memory, states[:, VELOCITY], states[:, HEADING], yaw_rate)


def make_controller(config: TransportConfig) -> TimeOptimalController:
    """Plans the quickest motion from the start, with margins, and follows it by LQR."""
    return TimeOptimalController(
        beam=config.beam,
        robot=config.believed_robot,
        task=config.task,
        sigma_rad=config.sigma_rad,
    )
