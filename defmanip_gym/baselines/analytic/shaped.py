"""``shaped``: a moving reference that leaves no swing behind, and feedback that keeps to it.

N. C. Singer, W. P. Seering, "Preshaping command inputs to reduce system vibration", Journal of
Dynamic Systems, Measurement, and Control 112 (1990). The motion of a point along the velocity field
is convolved with the impulses of a shaper for the object's slowest swing. Nothing looks at the
swing itself: this is what feedforward alone can do.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.baselines.analytic.law_params import WayLawParams
from defmanip_gym.baselines.analytic.sampled_law import Array, Memory, SampledLaw
from defmanip_gym.baselines.analytic.way_params import WayParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.payloads.rod import beam_payload
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.input_shaping import ShaperKind, shaper, slowest_swing
from defmanip_gym.theory.control.moving_reference import MovingReference
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base
from defmanip_gym.theory.payload.zero_dynamics import linearize
from defmanip_gym.validation import (
    require_choice,
    require_params,
    require_positive,
    settle,
)


@dataclass(frozen=True, kw_only=True)
class ShapedParams(WayLawParams):
    """Design choices of ``shaped``; they are what a study found.

    Attributes:
        shaper: ``"zv"``, ``"zvd"`` or ``"zvdd"``: each takes half a period of the swing more, and
            leaves less of it where the frequency is not the believed one.
        way: along which the point moves before its motion is shaped. The shaper spreads
            accelerations over a period of the swing, so they may be larger than the task's.
        acceleration_m_s2: largest of the point, on its way and in height.
        position_gain: of the feedback, 1/s².
        velocity_gain: of the feedback, 1/s.
    """

    shaper: ShaperKind = "zvd"
    way: WayParams = field(
        default_factory=lambda: WayParams(
            velocity_field="normalized",
            deceleration_m_s2=5.95,
            vertical_deceleration_m_s2=0.32,
            approach_rate_per_s=14.3,
        )
    )
    acceleration_m_s2: float = 10.0
    position_gain: float = 6.1
    velocity_gain: float = 7.8

    def __post_init__(self) -> None:
        super().__post_init__()
        require_choice("shaper", self.shaper, get_args(ShaperKind))
        settle(self, "acceleration_m_s2", require_positive, "m/s²")
        settle(self, "position_gain", require_positive, "1/s²")
        settle(self, "velocity_gain", require_positive, "1/s")


class ShapedController(SampledLaw):
    """Follows a shaped motion along the field; any object, by its slowest swing.

    Args:
        beam: the object as the controller knows it.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        params: design choices.

    Raises:
        GainError: the object does not oscillate.
    """

    params: ShapedParams

    def __init__(
        self,
        *,
        beam: BeamParams | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        params: ShapedParams | None = None,
    ) -> None:
        params = (
            ShapedParams() if params is None else require_params("params", params, ShapedParams)
        )
        super().__init__(payload=beam_payload(beam), robot=robot, task=task, params=params)
        self.field = params.way.field(self.task, self.goal_reach_m)
        self.weights = shaper(
            *slowest_swing(linearize(self.beam)), self.task.control_period_s, self.params.shaper
        )

    def begin(self, now: GraspSample) -> Memory:
        """Return the past of a point at rest: positions, velocities, accelerations, (n, K, 3)."""
        past = np.repeat(now.position[:, None], len(self.weights), axis=1)
        return past, np.zeros_like(past), np.zeros_like(past)

    def command(self, now: GraspSample, memory: Memory) -> tuple[Array, Memory]:
        """Return the shaped acceleration with feedback on the shaped position and velocity."""
        params, period = self.params, self.task.control_period_s
        positions, velocities, accelerations = memory
        point = MovingReference.at(positions[:, 0], velocities[:, 0]).steered(
            self.field, params.acceleration_m_s2, period
        )
        accelerations = _newer(accelerations, point.acceleration)
        far, fast, wanted = (
            np.einsum("k,nkc->nc", self.weights, past)
            for past in (positions, velocities, accelerations)
        )
        far -= now.position
        fast -= base_to_world(now.velocity_b, now.heading)
        u_o = wanted + params.position_gain * far + params.velocity_gain * fast
        after = point.moved(period)
        return world_to_base(u_o, now.heading), (
            _newer(positions, after.position),
            _newer(velocities, after.velocity),
            accelerations,
        )


def _newer(past: Array, newest: Array) -> Array:
    """Return a past (n, K, 3), newest first, with one sample more and the oldest forgotten."""
    return np.concatenate((newest[:, None], past[:, :-1]), axis=1)


def make_controller(config: TransportConfig) -> ShapedController:
    """Input shaping of a motion along the field, and feedback that keeps to it."""
    return ShapedController(beam=config.beam, robot=config.believed_robot, task=config.task)
