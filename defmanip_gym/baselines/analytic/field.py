"""Field, tracking and disturbance observer: the paper's outer loop without a model of the payload.

What the PI force loop of Section IV does for the paper's controller, a disturbance observer on w
does here, and the grasp follows the swinging object, which damps it. Made for the environment's
inner loop ``"measured_force"``; of the object only the shape counts.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.field_tracking import FieldTracking
from defmanip_gym.baselines.analytic.grasp_sample import GraspSample, grasp_sample
from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.config import InnerLoopKind, TransportConfig
from defmanip_gym.errors import GainError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.disturbance_observer import (
    DisturbanceObserver,
    ObserverMemory,
    weight_disturbance,
)
from defmanip_gym.theory.control.observed_loop import ObservedLoop
from defmanip_gym.theory.control.swing_following import SwingFollowing
from defmanip_gym.theory.control.velocity_field import NormalizedField
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import (
    require_choice,
    require_non_negative,
    require_params,
    require_positive,
    settle,
)

Array = NDArray[np.float64]

_SPEED_SHARE = 0.9  # of the limit, so that the limiter stays out of it


@dataclass(frozen=True, kw_only=True)
class FieldParams:
    """Design choices of the controller that are not the robot's or the object's.

    Attributes:
        inner_loop: that the environment has; with ``"model"`` the first force reading tells the
            first estimate of the disturbance.
        tracking_gain: ε in L = −ε I, 1/s.
        approach_rate: speed per distance near the goal, 1/s.
        acceleration_bound: largest |u_o| on each axis, m/s².
        deceleration_share: share of that bound that the speed profile plans to brake with.
        yaw_rate_bound: rad/s.
        observer_gain: L of the disturbance observer, 1/s.
        following_rate: κ of swing following, 1/s.
    """

    inner_loop: InnerLoopKind = "measured_force"
    tracking_gain: float = 4.0
    approach_rate: float = 4.0
    acceleration_bound: float = 2.55
    deceleration_share: float = 0.53
    yaw_rate_bound: float = 1.0
    observer_gain: float = 5.0
    following_rate: float = 2.0

    def __post_init__(self) -> None:
        require_choice("inner_loop", self.inner_loop, get_args(InnerLoopKind))
        for name in (
            "tracking_gain",
            "approach_rate",
            "acceleration_bound",
            "deceleration_share",
            "yaw_rate_bound",
        ):
            settle(self, name, require_positive)
        settle(self, "observer_gain", require_non_negative, "1/s")
        settle(self, "following_rate", require_non_negative, "1/s")


class FieldController:
    """Velocity field, tracking (20), swing following and a disturbance observer.

    Args:
        beam: the object as the controller knows it.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        params: design choices.

    Raises:
        GainError: the sampled loop would be unstable with these gains.
    """

    def __init__(
        self,
        *,
        beam: BeamParams | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        params: FieldParams | None = None,
    ) -> None:
        self.beam = BeamParams() if beam is None else require_params("beam", beam, BeamParams)
        self.robot = RobotParams() if robot is None else require_params("robot", robot, RobotParams)
        self.task = task = (
            TaskParams() if task is None else require_params("task", task, TaskParams)
        )
        self.params = (
            FieldParams() if params is None else require_params("params", params, FieldParams)
        )
        self._check_gains()
        self.layout = ObservationLayout(self.beam.segment_count)
        self.kinematics = ArmKinematics(self.robot)
        bound = min(self.params.acceleration_bound, task.max_acceleration_m_s2)
        braking = self.params.deceleration_share * bound
        self.field_tracking = FieldTracking(
            field=NormalizedField(
                max_speed_m_s=_SPEED_SHARE * task.max_speed_m_s,
                deceleration_m_s2=braking,
                vertical_deceleration_m_s2=braking,
                approach_rate_per_s=self.params.approach_rate,
            ),
            tracking_gain=self.params.tracking_gain,
            u_o_bound=np.full(3, bound),
            yaw_rate_bound=self.params.yaw_rate_bound,
            period_s=task.control_period_s,
            feedforward=True,
        )
        self.following = SwingFollowing(self.beam, rate=self.params.following_rate)
        self.observer = DisturbanceObserver(
            gain=self.params.observer_gain,
            period_s=task.control_period_s,
            w_limit=task.max_acceleration_m_s2,
            max_speed_m_s=task.max_speed_m_s,
        )

    @property
    def inner_loop(self) -> InnerLoopKind:
        """The inner loop that the environment is to have."""
        return self.params.inner_loop

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        return {
            "params": asdict(self.params),
            "beam": asdict(self.beam),
            "robot": asdict(self.robot),
            "task": asdict(self.task),
        }

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return w / a_max and (d, the w of this sample, the velocity that it was decided at)."""
        batch = np.atleast_2d(observation)
        now = grasp_sample(batch, self.layout, self.kinematics)
        u_o = self.field_tracking.tracking(now, *self.following.motion(now.swing, now.swing_rate))
        estimate = self._estimate(batch, now, state, episode_start)
        memory = self.observer.command(u_o, estimate, now.velocity_b, now.heading)
        action = memory.w / self.task.max_acceleration_m_s2
        return (
            action.reshape(*observation.shape[:-1], 3),
            (memory.estimate, memory.w, memory.velocity),
        )

    def _estimate(
        self,
        batch: Array,
        now: GraspSample,
        state: State | None,
        episode_start: NDArray[np.bool_] | None,
    ) -> Array:
        """Return d, (n, 3) m/s²: the observer's, or the first one where an episode starts."""
        if state is None:
            return self._first_estimate(batch, now)
        memory = ObserverMemory(estimate=state[0], w=state[1], velocity=state[2])
        estimate = self.observer.updated(memory, now.velocity_b, now.heading, now.yaw_rate)
        if episode_start is None or not np.any(episode_start):
            return estimate
        first = self._first_estimate(batch, now)
        return np.where(np.atleast_1d(episode_start)[:, None], first, estimate)

    def _first_estimate(self, batch: Array, now: GraspSample) -> Array:
        if self.params.inner_loop == "measured_force":
            return np.zeros((len(batch), 3))
        pitch = self.layout.part(batch, "joints") @ JOINT_TO_PITCH.T
        return weight_disturbance(self.robot, self.beam, pitch, now.force_b)

    def observed_loop(self) -> ObservedLoop:
        """Return the loop near the goal, if robot and beam are as the controller knows them."""
        params, believes = self.params, self.params.inner_loop == "model"
        return ObservedLoop(
            robot=self.robot,
            goal_pitch=JOINT_TO_PITCH @ np.array(self.task.goal[3:5]),
            beam=self.beam,
            believed_beam=self.beam if believes else None,
            tracking_gain=params.tracking_gain,
            approach_rate=params.approach_rate,
            observer_gain=params.observer_gain,
            following_rate=params.following_rate,
            period_s=self.task.control_period_s,
        )

    def _check_gains(self) -> None:
        radius = self.observed_loop().spectral_radius()
        # without observer or with an undamped object one mode stays as it is
        if radius > 1.0 + 1e-9:
            raise GainError(
                "(tracking_gain, approach_rate, observer_gain, following_rate)",
                (
                    self.params.tracking_gain,
                    self.params.approach_rate,
                    self.params.observer_gain,
                    self.params.following_rate,
                ),
                f"gains with a spectral radius up to 1 over a sample (here {radius:.5f})",
                "Lower one of them.",
            )


def make_controller(config: TransportConfig) -> FieldController:
    """Velocity field, tracking and disturbance observer over the inner loop that feels the load."""
    return FieldController(beam=config.beam, robot=config.believed_robot, task=config.task)
