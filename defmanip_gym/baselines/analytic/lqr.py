"""``lqr``: a sampled linear-quadratic regulator of grasp and swing about a moving reference.

B. D. O. Anderson, J. B. Moore, "Optimal Control: Linear Quadratic Methods", Prentice-Hall 1990.
A regulator alone would saturate from ten metres away. So it regulates the distance from a point
that moves along the velocity field within limits on speed and acceleration, and the swing's from
where that point's acceleration would hold the object at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.baselines.analytic.law_params import WayLawParams
from defmanip_gym.baselines.analytic.sampled_law import Array, Memory, SampledLaw
from defmanip_gym.baselines.analytic.way_params import WayParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.payloads.rod import beam_payload
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.moving_reference import MovingReference
from defmanip_gym.theory.control.sampled_lqr import (
    LqrWeights,
    forward_gains,
    quasi_static_swing,
    side_gains,
)
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base
from defmanip_gym.theory.payload.zero_dynamics import linearize
from defmanip_gym.validation import require_params, require_positive, settle


@dataclass(frozen=True, kw_only=True)
class LqrParams(WayLawParams):
    """Design choices of ``lqr``; with ``LqrWeights``' they are what a study found.

    Attributes:
        weights: of the regulators' errors.
        way: along which the reference moves.
        acceleration_m_s2: largest of the reference, on its way and in height.
    """

    weights: LqrWeights = field(default_factory=LqrWeights)
    way: WayParams = field(
        default_factory=lambda: WayParams(
            turn_radius_m=4.2,
            yaw_rate_rad_s=1.85,
            deceleration_m_s2=2.54,
            vertical_deceleration_m_s2=0.72,
            approach_rate_per_s=3.3,
        )
    )
    acceleration_m_s2: float = 2.55

    def __post_init__(self) -> None:
        super().__post_init__()
        settle(self, "weights", require_params, LqrWeights)
        settle(self, "acceleration_m_s2", require_positive, "m/s²")


class LqrController(SampledLaw):
    """Regulates grasp and swing about a point that moves along the field; any object.

    Args:
        beam: the object as the controller knows it.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        params: design choices.

    Raises:
        GainError: no regulator exists for these weights.
    """

    params: LqrParams

    def __init__(
        self,
        *,
        beam: BeamParams | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        params: LqrParams | None = None,
    ) -> None:
        params = LqrParams() if params is None else require_params("params", params, LqrParams)
        super().__init__(payload=beam_payload(beam), robot=robot, task=task, params=params)
        self.field = params.way.field(self.task, self.goal_reach_m)
        linear, period = linearize(self.beam), self.task.control_period_s
        self.forward_gains = forward_gains(linear, self.params.weights, period)
        self.side_gains = side_gains(self.params.weights, period)
        self.swing_per_acceleration = quasi_static_swing(linear)

    def begin(self, now: GraspSample) -> Memory:
        """Return the reference's position and velocity, those of the grasp."""
        return now.position, base_to_world(now.velocity_b, now.heading)

    def command(self, now: GraspSample, memory: Memory) -> tuple[Array, Memory]:
        """Return the reference's acceleration minus gains times errors."""
        reference = MovingReference.at(*memory).steered(
            self.field, self.params.acceleration_m_s2, self.task.control_period_s
        )
        wanted = world_to_base(reference.acceleration, now.heading)
        far = world_to_base(now.position - reference.position, now.heading)
        fast = now.velocity_b - world_to_base(reference.velocity, now.heading)
        swing = now.swing - wanted[:, :1] * self.swing_per_acceleration
        forward = np.column_stack((far[:, 0], fast[:, 0], swing, now.swing_rate))
        # not by BLAS, whose last bits depend on the number of rows
        forward_w = np.einsum("nk,k->n", forward, self.forward_gains)
        sideways = self.side_gains[0] * far + self.side_gains[1] * fast
        u_o = wanted - np.column_stack((forward_w, sideways[:, 1:]))
        after = reference.moved(self.task.control_period_s)
        return u_o, (after.position, after.velocity)


def make_controller(config: TransportConfig) -> LqrController:
    """Sampled LQR of grasp and swing about a point that moves along the field."""
    return LqrController(beam=config.beam, robot=config.believed_robot, task=config.task)
