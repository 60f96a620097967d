"""The paper's controller as a policy: velocity field, tracking, PI force loop (Sections III–IV).

The law itself is in ``cascade`` and ``field_tracking``. Its output w goes to the environment, whose
inner loop is the feedback linearization (28) with the redundancy resolution of Section IV.B.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.cascade import Cascade, LoopMemory
from defmanip_gym.baselines.analytic.gains import gains_for
from defmanip_gym.baselines.analytic.grasp_sample import grasp_sample
from defmanip_gym.baselines.analytic.motion_bounds import motion_bounds
from defmanip_gym.baselines.analytic.tanner_loop import require_stable, tanner_loop
from defmanip_gym.baselines.analytic.tanner_params import GENTLE_PARAMS, TannerParams
from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.control.stability import SampledLoop
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.validation import require_flag, require_params

__all__ = ["GENTLE_PARAMS", "TannerController", "TannerParams", "make_controller"]

Array = NDArray[np.float64]


class TannerController:
    """Velocity-field tracking with PI force feedback, within a certificate's bounds if given one.

    Args:
        beam: the object as the controller knows it.
        robot: the robot as the controller knows it.
        task: goal, limits and control period.
        certificate: bounds on the motion.
        params: design choices.
        require_stability: False builds the controller also with gains for which the sampled loop
            is unstable, to study what they do.

    Raises:
        GainError: the sampled loop would be unstable with these gains.
        CertificateError: the certificate is for another number of segments.
    """

    def __init__(
        self,
        *,
        beam: BeamParams | None = None,
        robot: RobotParams | None = None,
        task: TaskParams | None = None,
        certificate: Certificate | None = None,
        params: TannerParams | None = None,
        require_stability: bool = True,
    ) -> None:
        self.beam = BeamParams() if beam is None else require_params("beam", beam, BeamParams)
        self.robot = RobotParams() if robot is None else require_params("robot", robot, RobotParams)
        self.task = TaskParams() if task is None else require_params("task", task, TaskParams)
        self.params = (
            TannerParams() if params is None else require_params("params", params, TannerParams)
        )
        if certificate is not None:
            certificate = require_params("certificate", certificate, Certificate)
        self.certificate = certificate
        self.layout = ObservationLayout(self.beam.segment_count)
        self.object = HangingBeam(self.beam, damping=self.params.force_law_damping)
        self.kinematics = ArmKinematics(self.robot)
        self.bounds = motion_bounds(self.params, self.task, certificate, self.beam.segment_count)
        if require_flag("require_stability", require_stability):
            require_stable(self.sampled_loop())
        goal_pitch = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        goal_reach_m = float(self.kinematics.reach_and_height(goal_pitch)[0])
        self.field = self.bounds.velocity_field(self.params, goal_reach_m)
        self.cascade = Cascade(
            object=self.object,
            field=self.field,
            tracking_gain=self.params.tracking_gain,
            gains=self.params.gains,
            u_o_bound=self.params.bound_share * self.bounds.acceleration,
            w_limit=self.task.max_acceleration_m_s2,
            yaw_rate_bound=self.bounds.yaw_rate,
            period_s=self.task.control_period_s,
            feedforward=self.params.feedforward,
        )

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        certificate = None if self.certificate is None else asdict(self.certificate)
        parts = ("params", "beam", "robot", "task")
        return {name: asdict(getattr(self, name)) for name in parts} | {"certificate": certificate}

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return w / a_max and (∫Δu_o, the u_o of this sample)."""
        batch = np.atleast_2d(observation)
        memory = self._memory(len(batch), state, episode_start)
        command = self.cascade.command(grasp_sample(batch, self.layout, self.kinematics), memory)
        action = np.clip(command.w / self.task.max_acceleration_m_s2, -1.0, 1.0)
        memory = command.memory
        return action.reshape(*observation.shape[:-1], 3), (memory.error_integral, memory.u_o)

    def _memory(
        self, count: int, state: State | None, episode_start: NDArray[np.bool_] | None
    ) -> LoopMemory:
        """Return the force loop's memory, empty where an episode starts."""
        if state is None:
            return LoopMemory.empty(count)
        if episode_start is None:
            return LoopMemory(error_integral=state[0], u_o=state[1])
        running = ~np.atleast_1d(episode_start)[:, None]
        return LoopMemory(error_integral=state[0] * running, u_o=state[1] * running)

    def sampled_loop(self) -> SampledLoop:
        """Return the loop near the goal, if robot and beam are as the controller knows them."""
        return tanner_loop(
            self.params,
            beam=self.beam,
            linearization_beam=self.beam,
            robot=self.robot,
            task=self.task,
        )


def make_controller(
    config: TransportConfig, certificate: Certificate | None = None
) -> TannerController:
    """The paper's controller: velocity field, tracking and PI force loop."""
    beam, robot, task = config.beam, config.believed_robot, config.task
    params = TannerParams()
    if beam.segment_count > 1:  # whose force loop is another one
        params = gains_for(beam, robot=robot, task=task, params=params)
    return TannerController(
        beam=beam, robot=robot, task=task, certificate=certificate, params=params
    )
