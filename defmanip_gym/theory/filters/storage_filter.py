"""``storage``: V ≤ V_σ kept by the command nearest to the wished one (Lemma III.1 as a barrier)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg

from defmanip_gym.compiled import machine_code, without_garbage_collection
from defmanip_gym.errors import CertificateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams, validated_sigma
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import (
    JOINT_TO_PITCH,
    ArmKinematics,
    ArmLengths,
)
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.decision import (
    DecisionRoom,
    StorageLevels,
    decide_all,
    foresee_all,
    store_all,
)
from defmanip_gym.theory.filters.foresight import advance_all
from defmanip_gym.theory.filters.limits import RobotLimits
from defmanip_gym.theory.filters.safety_filter import (
    BoolArray,
    FilterDecision,
    FilterProof,
    SafetyFilter,
    finite_accelerations,
)
from defmanip_gym.theory.filters.sensed import Sensed, gained_acceleration
from defmanip_gym.theory.filters.storage import StorageModel
from defmanip_gym.theory.filters.swing_estimate import SwingEstimate
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.validation import require_params

_LEAST_BEND_RAD = 0.6
_LEAST_HEIGHT_SHARE = 1.5  # of the lowest grasp that ends no episode
_LEAST_LEVEL = 0.05  # of V_σ; below, errors leave nothing worth filtering for


class StorageMemory:
    """What a storage filter knows of the past of n episodes."""

    remembers = ("residual", "under_way", "before", "estimate")

    def __init__(self, count: int, delay_periods: int, estimate: SwingEstimate) -> None:
        self.residual = np.zeros((count, 3))  # m/s², of the last period
        self.under_way = np.zeros((delay_periods + 1, count, 3))  # the first takes effect next
        self.before = Sensed.empty(count, estimate.mean.shape[1])
        self.estimate = estimate


class StorageFilter(SafetyFilter):
    """Keeps B = V + ½ u2² (I_σ − I_z) below a level under V_σ: ‖z2‖∞ ≤ σ, however it is driven.

    Args:
        beam: that is believed to be carried.
        sigma_rad: σ.
        robot: that carries it.
        task: its limits and control period.
        conditions: errors, noise and delay that it makes room for.
        intervals: factors on the beam's parameters for which it holds.

    Attributes:
        pass_j: V_σ of the believed beam, J.
        level_share: up to which share of V_σ the storage may rise.

    Raises:
        CertificateError: there is no V_σ, or errors leave nothing of it.
    """

    name = "storage"
    proof: FilterProof = "nonlinear"

    def __init__(
        self,
        beam: BeamParams = BeamParams(),
        *,
        sigma_rad: float = math.pi / 6,
        robot: RobotParams = RobotParams(),
        task: TaskParams = TaskParams(),
        conditions: FilterConditions = FilterConditions(),
        intervals: PayloadIntervals = PayloadIntervals(),
    ) -> None:
        self.beam = require_params("beam", beam, BeamParams)
        self.robot = require_params("robot", robot, RobotParams)
        self.task = require_params("task", task, TaskParams)
        self.sigma_rad = validated_sigma(sigma_rad)
        self.conditions = require_params("conditions", conditions, FilterConditions)
        self.intervals = require_params("intervals", intervals, PayloadIntervals)
        self.segment_count = beam.segment_count
        self._layout = ObservationLayout(beam.segment_count)
        self._model = StorageModel.of(self.intervals.corners(beam), self.sigma_rad)
        self.pass_j = float(self._model.passes[0])
        shares = 1.0 - self._reserves()
        self.level_share = float(shares.min())
        if not self.level_share >= _LEAST_LEVEL:
            raise CertificateError(
                "share of V_σ that errors, noise and delay leave",
                self.level_share,
                f"at least {_LEAST_LEVEL}",
                "Allow a larger sigma_rad or smaller errors in conditions.",
            )
        self.setup = StorageLevels(
            model=self._model,
            levels=shares * self._model.passes,
            errors=np.array(
                (
                    conditions.forward_error_m_s2,
                    conditions.lateral_error_m_s2,
                    conditions.vertical_error_m_s2,
                )
            ),
            residual=float(conditions.storage_error),
            limits=self._limits(),
        )
        self._room = DecisionRoom.empty(self.segment_count)
        self._compile()
        self._compile_decision()

    @without_garbage_collection()
    def _compile(self) -> None:
        sensed, vectors, numbers, _ = self._examples()
        self._foresee = machine_code(foresee_all, self.setup, vectors, sensed, vectors)
        self._store = machine_code(store_all, self.setup, sensed, self._room, numbers)
        if self.conditions.delay_periods:
            self._advance = machine_code(
                advance_all, self.setup, vectors, vectors, sensed, self._room
            )

    @without_garbage_collection()
    def _compile_decision(self) -> None:
        sensed, vectors, numbers, uncertainty = self._examples()
        self._decide_all: Callable[..., None] = machine_code(
            decide_all,
            self.setup,
            vectors,
            sensed,
            vectors,
            uncertainty,
            self._room,
            vectors,
            numbers,
        )

    def _examples(self) -> tuple[Sensed, Array, Array, Array]:
        """Return states, vectors, numbers, uncertainties: compiled code learns types from them."""
        swing = np.empty((1, self.segment_count))
        return Sensed.empty(1, self.segment_count), np.empty((1, 3)), np.empty(1), swing

    def _decide(
        self, wished: Array, sensed: Sensed, residual: Array, uncertainty: Array
    ) -> FilterDecision:
        allowed, margin = np.empty_like(wished), np.empty(len(wished))
        self._decide_all(
            self.setup, wished, sensed, residual, uncertainty, self._room, allowed, margin
        )
        return FilterDecision(allowed, margin)

    def covers(self, beam: BeamParams) -> bool:
        """Whether it holds for this beam: the believed one within the intervals, however damped."""
        return self.intervals.cover(self.beam, beam)

    def memory(self, count: int) -> StorageMemory:
        """Return the memory of n episodes."""
        estimate = SwingEstimate(
            count,
            self.segment_count,
            noise_rad=self.conditions.swing_noise_rad,
            drift_rad=self._drift_rad,
            period_s=self.task.control_period_s,
        )
        return StorageMemory(count, self.conditions.delay_periods, estimate)

    def begin(self, memory: StorageMemory, observation: Array, started: BoolArray) -> None:
        """Let episodes start, (n,), with their first observations, (n, size)."""
        sensed = Sensed.observed(self._layout, observation)
        memory.residual[started] = 0.0
        memory.under_way[:, started] = 0.0
        memory.before = memory.before.replaced(sensed, started)
        if self.conditions.swing_noise_rad:
            memory.estimate.begin(sensed.swing, sensed.swing_rate, started)

    def certify_action(
        self, wished_m_s2: Any, observation: Array, memory: StorageMemory
    ) -> FilterDecision:
        """Return what may be commanded instead of the wished accelerations, (n, 3), now.

        Raises:
            ActionError: accelerations that are not finite or of another shape.
            ParameterError: observations of another size.
        """
        sensed, uncertainty = self._estimated(observation, memory)
        wished = finite_accelerations(wished_m_s2, len(sensed.swing))
        memory.before = Sensed(*(part.copy() for part in sensed))
        for commands in memory.under_way[:-1]:
            self._advance(self.setup, commands, memory.residual, sensed, self._room)
        decision = self._decide(wished, sensed, memory.residual, uncertainty)
        memory.under_way[-1] = decision.allowed_m_s2
        return decision

    def conclude(self, observation: Array, memory: StorageMemory) -> Array:
        """Take note of the observations, (n, size), at the end of the period.

        Returns:
            By how much accelerations were others than foreseen, (n, 3) m/s².
        """
        after = Sensed.observed(self._layout, observation)
        foreseen = np.empty_like(memory.residual)
        self._foresee(self.setup, memory.under_way[0], memory.before, foreseen)
        gained = gained_acceleration(memory.before, after, self.task.control_period_s)
        residual = gained - foreseen
        surprise = residual - memory.residual
        memory.residual = residual
        memory.under_way = np.concatenate((memory.under_way[1:], memory.under_way[:1]))
        if self.conditions.swing_noise_rad:
            memory.estimate.update(after.swing, after.swing_rate)
        return surprise

    def inside(self, observation: Array, memory: StorageMemory) -> BoolArray:
        """Whether B is below its level, (n,)."""
        within: BoolArray = self.storage_shares(observation, memory) <= 1.0
        return within

    def storage_shares(self, observation: Array, memory: StorageMemory) -> Array:
        """Return B over its level, (n,), at the least the noise allows for."""
        sensed, uncertainty = self._estimated(observation, memory)
        if self.conditions.swing_noise_rad:
            sensed = sensed._replace(swing=sensed.swing + np.copysign(uncertainty, sensed.swing))
        shares = np.empty(len(sensed.swing))
        self._store(self.setup, sensed, self._room, shares)
        return shares

    def _estimated(self, observation: Array, memory: StorageMemory) -> tuple[Sensed, Array]:
        sensed = Sensed.observed(self._layout, observation)
        if not self.conditions.swing_noise_rad:
            return sensed, np.zeros_like(sensed.swing)
        estimate = memory.estimate
        return sensed._replace(swing=estimate.mean.copy()), estimate.uncertainty

    def _limits(self) -> RobotLimits:
        robot, task = self.robot, self.task
        goal_pitch = JOINT_TO_PITCH @ np.array(task.goal[3:5])
        goal_reach = float(ArmKinematics(robot).reach_and_height(goal_pitch)[0])
        base = float(robot.base_mass_kg)
        arm = robot.upper_arm.mass_kg + robot.forearm.mass_kg
        return RobotLimits(
            arm=ArmLengths.of(robot),
            rule=RedundancyResolution(robot, goal_reach_m=goal_reach).rule,
            max_acceleration_m_s2=float(task.max_acceleration_m_s2),
            max_speed_m_s=float(task.max_speed_m_s),
            period_s=float(task.control_period_s),
            drive_force_n=float(robot.drive_force_limit_n),
            base_mass_kg=base,
            total_mass_kg=float(base + arm + self._model.mass.max()),
            least_bend_rad=_LEAST_BEND_RAD,
            lowest_m=float(_LEAST_HEIGHT_SHARE * task.smallest_grasp_height_m),
        )

    @property
    def _drift_rad(self) -> float:
        """The trapezoidal rule's error on φ̇ over a period."""
        period_s = self.task.control_period_s
        model = HangingBeam(self.beam)
        stiffness = model.k_o22 + GRAVITY_M_S2 * np.diag(model.chain.constants.first_moments)
        inertia = model.chain.mass_matrix(np.full(self.segment_count, -np.pi / 2))[2:, 2:]
        squares, _ = scipy.linalg.eigh(stiffness, inertia)
        lightest = scipy.linalg.eigvalsh(inertia)[0]
        largest_rate = math.sqrt(2 * self.pass_j / lightest)
        return float(min(period_s**3 / 12 * squares[-1], period_s) * largest_rate)

    def _reserves(self) -> Array:
        """Return the shares of V_σ that are kept back, (C,); docs/derivations.md, section 14."""
        model, conditions, task = self._model, self.conditions, self.task
        period_s = task.control_period_s
        total = model.moments.sum(axis=1)
        widest = 2 * math.sin(self.sigma_rad) * total
        highest = (1 - math.cos(self.sigma_rad)) * total
        forward, upward = conditions.forward_error_m_s2, conditions.vertical_error_m_s2
        # while the speed limit forbids to damp
        at_the_limit = forward * widest + upward * highest
        # |s| ≤ √(2 m V); all errors of the periods under way
        momentum = np.sqrt(2 * model.mass * model.passes)
        per_period = period_s * momentum * math.hypot(forward, upward)
        delayed = conditions.delay_periods * (per_period + conditions.storage_error * model.passes)
        # between samples V is at most this much above the larger of its ends
        pull = GRAVITY_M_S2 * math.sin(self.sigma_rad) + task.max_acceleration_m_s2
        between = period_s**2 / 8 * model.mass * pull * task.max_acceleration_m_s2
        reserves: Array = (at_the_limit + delayed + between) / model.passes
        return reserves
