"""Field, tracking and disturbance observer: the paper's outer loop without a model of the payload.

What the PI force loop of Section IV does for the paper's controller, a disturbance observer on w
does here, and the grasp follows the swinging object, which damps it. Made for the environment's
inner loop ``"measured_force"``; of the object only the shape counts. Derivation:
docs/derivations.md, section 21.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from defmanip_gym.baselines.analytic.field_tracking import FieldTracking
from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.baselines.analytic.law_params import WayLawParams
from defmanip_gym.baselines.analytic.sampled_law import Array, Memory, SampledLaw
from defmanip_gym.baselines.analytic.way_params import WayParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import GainError
from defmanip_gym.params import RobotParams
from defmanip_gym.payloads.payload import Payload
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.observed_loop import ObservedLoop
from defmanip_gym.theory.control.swing_following import SwingFollowing
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH
from defmanip_gym.validation import require_non_negative, require_params, require_positive, settle


@dataclass(frozen=True, kw_only=True)
class FieldParams(WayLawParams):
    """Design choices of ``field``; with the inner loop ``"model"`` it weighs the object first.

    The defaults are what a study found (docs/training.md).

    Attributes:
        way: the field to travel.
        observer_gain_per_s: L of the disturbance observer, 1/s.
        tracking_gain: ε in L = −ε I, 1/s.
        acceleration_bound: largest |u_o| on each axis, m/s².
        yaw_rate_bound: rad/s.
        following_rate: κ of swing following, 1/s.
    """

    way: WayParams = field(
        default_factory=lambda: WayParams(
            turn_radius_m=2.6,
            yaw_rate_rad_s=1.1,
            speed_share=0.99,
            deceleration_m_s2=1.9,
            vertical_deceleration_m_s2=0.85,
            approach_rate_per_s=4.7,
        )
    )
    observer_gain_per_s: float = 6.0
    tracking_gain: float = 3.5
    acceleration_bound: float = 2.85
    yaw_rate_bound: float = 2.4
    following_rate: float = 2.5

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("tracking_gain", "acceleration_bound", "yaw_rate_bound"):
            settle(self, name, require_positive)
        settle(self, "following_rate", require_non_negative, "1/s")


class FieldController(SampledLaw):
    """Velocity field, tracking (20), swing following and a disturbance observer; any object.

    Args:
        payload: the object as the controller knows it, the reference rod by default.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        params: design choices.

    Raises:
        GainError: the sampled loop would be unstable with these gains.
    """

    params: FieldParams

    def __init__(
        self,
        *,
        payload: Payload | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        params: FieldParams | None = None,
    ) -> None:
        params = FieldParams() if params is None else require_params("params", params, FieldParams)
        super().__init__(payload=payload or RodPayload(), robot=robot, task=task, params=params)
        self.field = params.way.field(self.task, self.goal_reach_m)
        self._check_gains()
        bound = min(params.acceleration_bound, self.task.max_acceleration_m_s2)
        self.law = FieldTracking(
            field=self.field,
            tracking_gain=params.tracking_gain,
            u_o_bound=np.full(3, bound),
            yaw_rate_bound=params.yaw_rate_bound,
            period_s=self.task.control_period_s,
            feedforward=True,
        )
        self.following = SwingFollowing(self.payload.linear, rate=params.following_rate)

    def begin(self, now: GraspSample) -> Memory:
        """Return nothing: the law has no memory of its own."""
        return ()

    def command(self, now: GraspSample, memory: Memory) -> tuple[Array, Memory]:
        """Return u_o of Eq. (20) with the velocity that follows the swing, (n, 3) m/s²."""
        return self.law.tracking(now, *self.following.motion(now.swing, now.swing_rate)), memory

    def observed_loop(self) -> ObservedLoop:
        """Return the loop near the goal, if robot and beam are as the controller knows them."""
        params, believes = self.params, self.params.inner_loop == "model"
        return ObservedLoop(
            robot=self.robot,
            goal_pitch=JOINT_TO_PITCH @ np.array(self.task.goal[3:5]),
            carried=self.payload.linear,
            believed=self.payload.linear if believes else None,
            tracking_gain=params.tracking_gain,
            approach_rate=params.way.approach_rate_per_s,
            observer_gain=params.observer_gain_per_s,
            following_rate=params.following_rate,
            period_s=self.task.control_period_s,
            felt_inertia_kg=self.payload.felt_inertia_kg,
        )

    def _check_gains(self) -> None:
        radius = self.observed_loop().spectral_radius()
        # without observer or with an undamped object one mode stays as it is
        if radius > 1.0 + 1e-9:
            params = self.params
            gains = params.tracking_gain, params.observer_gain_per_s, params.following_rate
            raise GainError(
                "(tracking_gain, observer_gain_per_s, following_rate)",
                gains,
                f"gains with a spectral radius up to 1 over a sample (here {radius:.5f})",
                "Lower one of them, or the way's approach rate.",
            )


def make_controller(config: TransportConfig) -> FieldController:
    """Velocity field, tracking and disturbance observer over the inner loop that feels the load."""
    return FieldController(payload=config.payload, robot=config.believed_robot, task=config.task)
