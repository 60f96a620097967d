"""Plans the quickest motion from where an episode begins, and follows it.

The plan is the optimal control problem's answer with margins (``planning``), taken from the stored
ones where the start is known, which is planning offline, and solved for where it is not. It is
followed by linear-quadratic regulation about it, and held at the goal by the same law.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.grasp_sample import grasp_sample
from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.planning.limits import Margins
from defmanip_gym.planning.model import HEADING, REACH, REACH_RATE, STATE_SIZE, SWING, Array
from defmanip_gym.planning.search import SearchParams, best_plan
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.planning.stored import StoredPlans, shipped_plans
from defmanip_gym.planning.tracking import Track, TrackingWeights, holding_gain, track_of
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.frames import world_to_base
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import require_params, settle

# sensors may be noisy, and no two stored starts differ in the swing alone
_SWING_TOLERANCE_RAD = 0.2


@dataclass(frozen=True, kw_only=True)
class TimeOptimalParams:
    """Design choices.

    Attributes:
        margins: of plans that are made here; stored ones have been made with their own.
        weights: of the regulation about the plan.
        search: how thoroughly plans are searched for here.
    """

    margins: Margins = Margins()
    weights: TrackingWeights = TrackingWeights()
    search: SearchParams = field(default_factory=lambda: SearchParams(fine_intervals=80, kept=1))

    def __post_init__(self) -> None:
        settle(self, "margins", require_params, Margins)
        settle(self, "weights", require_params, TrackingWeights)
        settle(self, "search", require_params, SearchParams)


class TimeOptimalController:
    """Plans at the beginning of each episode, then follows.

    Its state holds where each episode began, (n, 6), and how many samples ago, (n,). Plans and
    gains follow from the start alone, and are made once for each.

    Args:
        beam: the object as the controller knows it, a rigid rod.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        sigma_rad: σ.
        params: design choices.
        plans: that are known beforehand; those of the package by default, where they were made for
            this robot, beam and task.

    Raises:
        ParameterError: the beam has several segments.
    """

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
        params = TimeOptimalParams() if params is None else params
        self.params = require_params("params", params, TimeOptimalParams)
        self.plans = _fitting_plans(self.setting) if plans is None else plans
        self.layout = ObservationLayout(1)
        self.kinematics = ArmKinematics(self.setting.robot)
        period_s = self.setting.task.control_period_s
        self._hold = holding_gain(self.setting.model, period_s, self.params.weights)
        self._tracks: dict[bytes, Track] = {}

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return w / a_max and (starts, samples since then).

        Raises:
            InstallationError: a start that no stored plan is for, and CasADi is not installed.
            ParameterError: a start without plan.
        """
        batch = np.atleast_2d(observation)
        if state is None:
            starts, steps = self._starts(batch), np.zeros(len(batch), dtype=np.int64)
        else:
            starts, steps = state
            if episode_start is not None and np.any(episode_start):
                begins = np.atleast_1d(episode_start)
                starts = np.where(begins[:, None], self._starts(batch), starts)
                steps = np.where(begins, 0, steps)
        states = self.states(batch)
        rows = zip(states, starts, steps.tolist(), strict=True)
        w = np.array([self._command(now, self._track(start), step) for now, start, step in rows])
        action = np.clip(w / self.setting.task.max_acceleration_m_s2, -1.0, 1.0)
        return action.reshape(*observation.shape[:-1], 3), (starts, steps + 1)

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        return {
            "setting": asdict(self.setting),
            "params": asdict(self.params),
            "plans": self.plans.digest,
        }

    def _command(self, now: Array, track: Track, step: int) -> Array:
        """Return w of one episode, (3,) m/s²."""
        if step < len(track.commands):
            error = now - track.states[step]
            error[HEADING] = math.remainder(error[HEADING], math.tau)
            command: Array = track.commands[step] - track.gains[step] @ error
            return command
        error = now.copy()
        error[:3] = world_to_base(now[:3], now[HEADING])
        held: Array = -self._hold @ error
        return held

    def _track(self, start: Array) -> Track:
        """Return the plan from a start, in samples and with gains."""
        key = start.tobytes()
        if key not in self._tracks:
            setting, params = self.setting, self.params
            known = self.plans.find(start, swing_tolerance_rad=_SWING_TOLERANCE_RAD)
            if known is not None:
                plan = known.drive
            else:
                limits, begin = setting.limits(params.margins), setting.state_at(start.tolist())
                plan = best_plan(setting.model, limits, begin, params.search)
            period_s = setting.task.control_period_s
            self._tracks[key] = track_of(setting.model, plan, period_s, params.weights)
        return self._tracks[key]

    def states(self, batch: Array) -> Array:
        """Return what observations (n, size) say of the planner's state, (n, 11)."""
        now = grasp_sample(batch, self.layout, self.kinematics)
        pitch_rate = self.layout.part(batch, "joint_rates") @ JOINT_TO_PITCH.T
        pitch = self.layout.part(batch, "joints") @ JOINT_TO_PITCH.T
        states = np.empty((len(batch), STATE_SIZE))
        states[:, :3], states[:, HEADING] = now.position, now.heading
        states[:, 4:7] = now.velocity_b
        states[:, REACH] = now.reach
        states[:, REACH_RATE] = (self.kinematics.jacobian(pitch)[:, 0] * pitch_rate).sum(axis=1)
        states[:, SWING:] = np.hstack((now.swing, now.swing_rate))
        return states

    def _starts(self, batch: Array) -> Array:
        """Return the pose that observations (n, size) tell of, (n, 6), rounded."""
        now = grasp_sample(batch, self.layout, self.kinematics)
        goal = self.setting.task.goal
        ahead = self.setting.goal_reach_and_height_m[0] + now.position[:, 0]
        ahead = ahead - now.reach * np.cos(now.heading)
        aside = now.position[:, 1] - now.reach * np.sin(now.heading)
        cos, sin = math.cos(goal[2]), math.sin(goal[2])
        joints = self.layout.part(batch, "joints")
        columns = (
            goal[0] + cos * ahead - sin * aside,
            goal[1] + sin * ahead + cos * aside,
            goal[2] + now.heading,
            joints[:, 0],
            joints[:, 1],
            now.swing[:, 0],
        )
        return np.stack(columns, axis=-1)


def make_controller(config: TransportConfig) -> TimeOptimalController:
    """Plans the quickest motion from the start, with margins, and follows it by LQR."""
    return TimeOptimalController(
        beam=config.beam,
        robot=config.believed_robot,
        task=config.task,
        sigma_rad=config.sigma_rad,
    )


def _fitting_plans(setting: PlanningSetting) -> StoredPlans:
    """Return the package's plans, or none where they were made for something else."""
    stored = shipped_plans()
    own = setting.identity
    fits = all(stored.made_with.get(key) == value for key, value in own.items())
    return stored if fits else StoredPlans(made_with=own)
