"""``mpc``: plans the next seconds anew in every period, with the swing among the limits.

D. Q. Mayne, J. B. Rawlings, C. V. Rao, P. O. M. Scokaert, "Constrained model predictive control:
stability and optimality", Automatica 36 (2000); one quadratic program a period, linearized along
the last plan, as in M. Diehl, H. G. Bock, J. P. Schlöder, "A real-time iteration scheme for
nonlinear optimization in optimal feedback control", SIAM J. Control Optim. 43 (2005). The reference
is the streamline from where the grasp is, travelled at full speed nearly up to the goal: when to
brake, and how, is left to the program.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.baselines.analytic.mpc_params import MpcParams
from defmanip_gym.baselines.analytic.sampled_law import Array, Memory, SampledLaw
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams, RobotParams, validated_sigma
from defmanip_gym.payloads.rod import beam_payload
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.control_laws import saturated_tracking
from defmanip_gym.theory.control.horizon import HorizonStart
from defmanip_gym.theory.control.moving_reference import streamline
from defmanip_gym.theory.control.prediction import Prediction
from defmanip_gym.theory.control.receding_horizon import HorizonProgram
from defmanip_gym.theory.dynamics.frames import base_to_world, turned, world_to_base
from defmanip_gym.theory.payload.zero_dynamics import linearize
from defmanip_gym.validation import require_params

__all__ = ["MpcController", "MpcParams", "make_controller"]

_SLOW_M_S = 0.3  # below it the streamline tells better where the grasp is heading
_STEP_S = 0.1  # along streamlines


class MpcController(SampledLaw):
    """Follows the plan that is best now for the next two seconds; any object.

    Where the solver fails, it tracks the field by Eq. (20) for that period.

    Args:
        beam: the object as the controller knows it.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        sigma_rad: σ.
        params: design choices.

    Raises:
        InstallationError: DAQP is not installed.
    """

    params: MpcParams

    def __init__(
        self,
        *,
        beam: BeamParams | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        sigma_rad: float = np.pi / 6,
        params: MpcParams | None = None,
    ) -> None:
        params = MpcParams() if params is None else require_params("params", params, MpcParams)
        super().__init__(payload=beam_payload(beam), robot=robot, task=task, params=params)
        self.field = params.way.field(self.task, self.goal_reach_m)
        self.limit = params.acceleration_share * self.task.max_acceleration_m_s2
        self.prediction = Prediction(
            linearize(self.beam), params.blocks, self.task.control_period_s
        )
        self.program = HorizonProgram(
            self.prediction,
            params.weights,
            sigma_rad=params.sigma_share * validated_sigma(sigma_rad),
            acceleration_m_s2=self.limit,
            heading_rad=params.heading_share * self.task.heading_tolerance_rad,
        )

    def begin(self, now: GraspSample) -> Memory:
        """Return a plan that accelerates nothing, (n, M, 2) m/s², in axes that do not turn."""
        return (np.zeros((len(now.position), len(self.params.blocks), 2)),)

    def command(self, now: GraspSample, memory: Memory) -> tuple[Array, Memory]:
        """Return the first accelerations of the plan that is best now."""
        start = self._start(now, memory[0][:, self.prediction.following])
        plan, found = self.program.solve(start)
        u_o = self._tracking(now)
        u_o[found, :2] = plan[found, 0]
        return u_o, (np.stack(turned(*_components(plan), start.headings.middle), axis=-1),)

    def _start(self, now: GraspSample, plan: Array) -> HorizonStart:
        """Return where episodes are, and the streamlines ahead of them."""
        velocity, prediction = base_to_world(now.velocity_b, now.heading), self.prediction
        way, speeds = streamline(self.field, now.position, prediction.times_s, _STEP_S)
        planned = velocity[:, None, :2] + np.einsum("kb,nbc->nkc", prediction.velocity, plan)
        is_fast = np.hypot(*_components(planned)) > _SLOW_M_S
        towards_x, towards_y = _components(np.where(is_fast[..., None], planned, speeds[..., :2]))
        limit, climbing = self.params.way.speed_m_s(self.task), velocity[:, 2]
        return HorizonStart(
            position=now.position[:, :2],
            velocity=velocity[:, :2],
            swing=np.concatenate((now.swing, now.swing_rate), axis=1),
            reference=way[..., :2],
            reference_velocity=speeds[..., :2],
            headings=prediction.courses(now.heading, velocity[:, :2], plan, now.reach),
            courses=np.arctan2(towards_y, towards_x),
            speed_limit=np.sqrt(np.maximum(limit**2 - climbing**2, 0.0)),
            plan=plan,
        )

    def _tracking(self, now: GraspSample) -> Array:
        """Return u_o of Eq. (20), (n, 3) m/s²."""
        desired = world_to_base(self.field.velocity(now.position), now.heading)
        bound = np.full(3, self.limit)
        return saturated_tracking(now.velocity_b - desired, self.params.tracking_gain, bound)


def _components(vectors: Array) -> tuple[Array, Array]:
    return vectors[..., 0], vectors[..., 1]


def make_controller(config: TransportConfig) -> MpcController:
    """Receding horizon with the swing among its limits, a quadratic program in every period."""
    return MpcController(
        beam=config.beam, robot=config.believed_robot, task=config.task, sigma_rad=config.sigma_rad
    )
