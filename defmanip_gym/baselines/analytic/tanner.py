"""The paper's controller as a policy: velocity field, tracking, PI force loop (Sections III–IV).

Its output w goes to the environment, whose inner loop is the feedback linearization (28) with the
redundancy resolution of Section IV.B.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.cascade import Cascade, LoopMemory
from defmanip_gym.baselines.analytic.field_tracking import YAW_SHARE
from defmanip_gym.baselines.analytic.grasp_sample import grasp_sample
from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError, GainError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.oriented_field import OrientedField
from defmanip_gym.theory.control.stability import SampledLoop
from defmanip_gym.theory.control.velocity_field import LiteralField, NormalizedField, VelocityField
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.validation import (
    require_choice,
    require_flag,
    require_number,
    require_params,
    require_positive,
    settle,
)

Array = NDArray[np.float64]
FieldKind = Literal["normalized", "literal", "oriented"]


@dataclass(frozen=True, kw_only=True)
class TannerParams:
    """Design choices of the controller that are not the robot's or the object's.

    The defaults are what a study found (docs/training.md).

    Attributes:
        velocity_field: ``"normalized"`` travels the dipole's streamlines with a speed profile,
            ``"literal"`` is −k ∇φ as printed, ``"oriented"`` leads by short ways along +x from
            anywhere, with any heading.
        literal_k: k of the literal field.
        tracking_gain: ε in L = −ε I, 1/s.
        approach_rate: speed per distance near the goal, 1/s.
        feedforward: add z̈_1d, the field's change along the motion; the paper has none.
        gains: k1 and k2 of the force loop (29).
        force_law_damping: d̂ assumed in the force law (10). Zero lets the force loop add damping;
            more than 4/3 of the true value destabilizes a uniform rod.
        acceleration_bound: bound on u_o where no certificate gives one, m/s².
        yaw_rate_bound: where no certificate gives one, rad/s.
        bound_share: share of the bounds that u_o uses, leaving the rest to the force loop.
        deceleration_share: share of the bound that the speed profile plans to brake with.
        speed_share: share of the speed limit that the field uses.
        turn_radius: R of the oriented field, m.
    """

    velocity_field: FieldKind = "normalized"
    literal_k: float = 1.0
    tracking_gain: float = 6.0
    approach_rate: float = 3.0
    feedforward: bool = True
    gains: ForceLoopGains = field(default_factory=lambda: ForceLoopGains(k1=0.05, k2=8.0))
    force_law_damping: float = 0.0
    acceleration_bound: float = 3.0
    yaw_rate_bound: float = 2.5
    bound_share: float = 0.85
    deceleration_share: float = 0.68
    speed_share: float = 0.9
    turn_radius: float = 1.5

    def __post_init__(self) -> None:
        require_choice("velocity_field", self.velocity_field, get_args(FieldKind))
        for name in (
            "literal_k",
            "tracking_gain",
            "approach_rate",
            "acceleration_bound",
            "yaw_rate_bound",
            "bound_share",
            "deceleration_share",
            "turn_radius",
        ):
            settle(self, name, require_positive)
        settle(self, "speed_share", require_number, 1e-3, 1.0)
        settle(self, "feedforward", require_flag)
        settle(self, "gains", require_params, ForceLoopGains)
        settle(self, "force_law_damping", require_number, -1e4, 1e4, "N m s/rad")


# As first chosen, by hand: what shipped residual agents correct, and what the reproduction runs.
GENTLE_PARAMS = TannerParams(
    tracking_gain=2.0,
    approach_rate=0.5,
    gains=ForceLoopGains(k1=0.5, k2=2.0),
    acceleration_bound=1.0,
    yaw_rate_bound=1.0,
    bound_share=0.85,
    deceleration_share=0.5,
)


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
        self._check_certificate()
        if require_flag("require_stability", require_stability):
            self._check_gains()
        self.bound, self.yaw_rate_bound, max_speed = self._bounds()
        self.field = self._velocity_field(max_speed)
        self.cascade = Cascade(
            object=self.object,
            field=self.field,
            tracking_gain=self.params.tracking_gain,
            gains=self.params.gains,
            u_o_bound=self.params.bound_share * self.bound,
            w_limit=self.task.max_acceleration_m_s2,
            yaw_rate_bound=self.yaw_rate_bound,
            period_s=self.task.control_period_s,
            feedforward=self.params.feedforward,
        )

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        certificate = self.certificate
        return {
            "params": asdict(self.params),
            "beam": asdict(self.beam),
            "robot": asdict(self.robot),
            "task": asdict(self.task),
            "certificate": None if certificate is None else asdict(certificate),
        }

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

    def _bounds(self) -> tuple[Array, float, float]:
        """Return the bound on w per axis (m/s²), on the yaw rate and on the speed."""
        params, certificate = self.params, self.certificate
        if certificate is None:
            forward = min(params.acceleration_bound, self.task.max_acceleration_m_s2)
            return (
                np.full(3, forward),
                params.yaw_rate_bound,
                params.speed_share * self.task.max_speed_m_s,
            )
        conditions = certificate.conditions
        forward = min(certificate.acceleration_bound, self.task.max_acceleration_m_s2)
        upward = min(certificate.vertical_acceleration_bound, self.task.max_acceleration_m_s2)
        yaw_rate = min(conditions.yaw_rate_rad_s, params.yaw_rate_bound)
        leftward = (
            self.task.max_acceleration_m_s2 if math.isinf(certificate.speed_bound) else forward
        )
        speed = params.speed_share * min(self.task.max_speed_m_s, certificate.speed_bound)
        return np.array([forward, leftward, upward]), yaw_rate, speed

    def _velocity_field(self, max_speed: float) -> VelocityField:
        if self.params.velocity_field == "literal":
            return LiteralField(k=self.params.literal_k)
        forward, leftward, upward = self.bound.tolist()
        braking = self.params.deceleration_share
        if self.params.velocity_field == "normalized":
            return NormalizedField(
                max_speed_m_s=max_speed,
                deceleration_m_s2=braking * forward,
                vertical_deceleration_m_s2=braking * upward,
                approach_rate_per_s=self.params.approach_rate,
            )
        pitch = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        return OrientedField(
            reach_m=float(self.kinematics.reach_and_height(pitch)[0]),
            max_speed_m_s=max_speed,
            deceleration_m_s2=braking * forward,
            vertical_deceleration_m_s2=braking * upward,
            approach_rate_per_s=self.params.approach_rate,
            lateral_acceleration_m_s2=self.params.bound_share * leftward,
            yaw_rate_rad_s=YAW_SHARE * self.yaw_rate_bound,
            turn_radius_m=self.params.turn_radius,
        )

    def _check_certificate(self) -> None:
        certificate = self.certificate
        if certificate is None:
            return
        if certificate.coordinate_count != self.beam.segment_count:
            raise CertificateError(
                "certificate.coordinate_count",
                certificate.coordinate_count,
                f"{self.beam.segment_count}, that of the beam carried",
                "Compute the certificate for this beam.",
            )
        if min(certificate.vertical_acceleration_bound, certificate.conditions.yaw_rate_rad_s) <= 0:
            raise CertificateError(
                "certificate.conditions",
                certificate.conditions,
                "room for vertical acceleration and yaw rate",
                "Pass conditions=TRANSPORT_CONDITIONS to certify().",
            )

    def sampled_loop(self) -> SampledLoop:
        """Return the loop near the goal, if robot and beam are as the controller knows them."""
        return SampledLoop(
            robot=self.robot,
            goal_pitch=JOINT_TO_PITCH @ np.array(self.task.goal[3:5]),
            beam=self.beam,
            linearization_beam=self.beam,
            force_law_damping=self.params.force_law_damping,
            gains=self.params.gains,
            tracking_gain=self.params.tracking_gain,
            approach_rate=self.params.approach_rate,
            period_s=self.task.control_period_s,
            feedforward=self.params.feedforward,
        )

    def _check_gains(self) -> None:
        radius = self.sampled_loop().spectral_radius()
        if radius >= 1.0:
            gains = self.params.gains
            raise GainError(
                "(k1, k2, force_law_damping)",
                (gains.k1, gains.k2, self.params.force_law_damping),
                f"gains with a spectral radius below 1 over a sample (here {radius:.5f})",
                "Lower k1 or k2, or assume less damping in the force law.",
            )


def make_controller(
    config: TransportConfig, certificate: Certificate | None = None
) -> TannerController:
    """The paper's controller: velocity field, tracking and PI force loop."""
    return TannerController(
        beam=config.beam, robot=config.believed_robot, task=config.task, certificate=certificate
    )
