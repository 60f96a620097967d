"""What all filters share that keep a storage below its level, whatever is carried."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Self

import numpy as np

from defmanip_gym.compiled import machine_code, without_garbage_collection
from defmanip_gym.errors import CertificateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import (
    JOINT_TO_PITCH,
    ArmKinematics,
    ArmLengths,
)
from defmanip_gym.theory.filters.barrier import DecisionRoom, StorageLevels
from defmanip_gym.theory.filters.batches import (
    advance_all,
    compare_all,
    decide_all,
    misjudge_all,
    store_all,
)
from defmanip_gym.theory.filters.carried import CarriedModel, CarriedRoom
from defmanip_gym.theory.filters.conditions import FilterConditions
from defmanip_gym.theory.filters.limits import BRAKING_SHARE, RobotLimits, height_range
from defmanip_gym.theory.filters.safety_filter import (
    BoolArray,
    FilterDecision,
    SafetyFilter,
    finite_accelerations,
    require_count,
)
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.swing_estimate import SwingEstimate
from defmanip_gym.validation import plain, require_whole

_LEAST_BEND_RAD = 0.6
_LEAST_HEIGHT_SHARE = 1.5  # of the lowest grasp that ends no episode
_LEAST_LEVEL = 0.05  # of V_σ; below, errors leave nothing worth filtering for


class StorageMemory:
    """What a storage filter knows of the past of n episodes."""

    remembers = ("residual", "under_way", "before", "estimate")

    def __init__(self, count: int, delay_periods: int, estimate: SwingEstimate) -> None:
        self.residual = np.zeros((count, 3))  # m/s², of the last period
        self.largest = np.zeros(6)  # of all, changes and residuals of the last period
        self.concluded: tuple[Array, Sensed] | None = None  # observations as last seen
        self.under_way = np.zeros((delay_periods + 1, count, 3))  # the first takes effect next
        self.before = Sensed.empty(count, estimate.mean.shape[1])
        self.estimate = estimate


class StorageKeeping(SafetyFilter):
    """A filter that keeps a storage B below a level under V_σ.

    Members say what is carried: its model, and what errors cost of V_σ. Observations are those of
    ``ObservationLayout(N)``.

    Attributes:
        conditions: errors, noise and delay that it makes room for.
        pass_j: V_σ of what is believed to be carried, J.
        level_share: up to which share of V_σ the storage may rise.
        equilibrium: z2*, (N,).
    """

    arguments: tuple[str, ...]  # of the constructor, each an attribute
    conditions: FilterConditions
    equilibrium: Array

    def _prepare(self, model: CarriedModel, momenta: Array, room: CarriedRoom | None) -> None:
        """Make and compile what decisions need.

        Args:
            model: of what may be carried.
            momenta: |m_o12ᵀ ż2| at its largest within V ≤ V_σ, (C,) kg·m/s.
            room: for one of its states; None for rods.
        """
        self._model: CarriedModel = model
        self._layout = ObservationLayout(self.segment_count)
        self.pass_j = float(model.passes[0])
        shares, conditions = self._level_shares(), self.conditions
        self.level_share = float(shares.min())
        self.setup = StorageLevels(
            model=model,
            levels=shares * model.passes,
            momenta=momenta,
            errors=np.minimum(
                (conditions.delay_periods + 1) * np.array(self.errors_m_s2),
                np.maximum(2 * np.array(self.offsets_m_s2), self.errors_m_s2),
            ),
            residual=float(conditions.storage_error),
            limits=self._limits(),
        )
        self._room = DecisionRoom.empty(self.segment_count, room)
        self._advancing = self.setup  # with which model the state is moved through a delay
        self._compile()
        self._compile_decision()

    @abstractmethod
    def modes(self) -> tuple[Array, Array]:
        """Return natural frequencies, (N,) rad/s, ascending, and shapes, (N, N), about z2*."""

    @abstractmethod
    def for_carried(self, carried: object) -> StorageKeeping:
        """Return the same filter for what is carried, known exactly."""

    @abstractmethod
    def _reserved_shares(self) -> Array:
        """Return the shares of V_σ that errors, noise and delay cost, (C,)."""

    def _drift_rad(self) -> float:
        """Return the largest error of carrying an angle along over a period by its rate."""
        return 0.0

    @without_garbage_collection()
    def _compile(self) -> None:
        sensed, vectors, numbers, _ = self._examples()
        self._compare = machine_code(
            compare_all, self.setup, vectors, sensed, sensed, vectors, vectors, numbers
        )
        self._store = machine_code(store_all, self.setup, sensed, self._room, numbers)
        self._misjudge = machine_code(misjudge_all, self.setup, sensed, sensed, self._room, numbers)
        if self.conditions.delay_periods:
            self._advance = machine_code(
                advance_all, self.setup, vectors, vectors, sensed, self._room
            )

    @without_garbage_collection()
    def _compile_decision(self) -> None:
        sensed, vectors, numbers, uncertainty = self._examples()
        room = self._room
        self._decide_all: Callable[..., None] = machine_code(
            decide_all, self.setup, vectors, sensed, vectors, uncertainty, room, vectors, numbers
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

    def _level_shares(self) -> Array:
        """Return up to which shares of V_σ B may rise, (C,), or raise CertificateError."""
        shares = 1.0 - self._reserved_shares()
        if not shares.min() >= _LEAST_LEVEL:
            raise CertificateError(
                "share of V_σ that errors, noise and delay leave",
                float(shares.min()),
                f"at least {_LEAST_LEVEL}",
                "Allow a larger sigma_rad or smaller errors in conditions.",
            )
        return shares

    @property
    def specification(self) -> dict[str, Any]:
        """What the filter was made with, as JSON values."""
        return {"name": self.name} | {name: plain(getattr(self, name)) for name in self.arguments}

    def __reduce__(self) -> tuple[Any, ...]:
        # machine code cannot be pickled: a copy makes its own
        return partial(type(self), **{name: getattr(self, name) for name in self.arguments}), ()

    @property
    def errors_m_s2(self) -> tuple[float, float, float]:
        """Errors of acceleration that it provides for: forward, to the side, upwards."""
        conditions = self.conditions
        return (
            conditions.forward_error_m_s2,
            conditions.lateral_error_m_s2,
            conditions.vertical_error_m_s2,
        )

    @property
    def offsets_m_s2(self) -> tuple[float, float, float]:
        """Offsets of acceleration that it provides for: forward, to the side (any), upwards."""
        conditions = self.conditions
        return conditions.forward_offset_m_s2, math.inf, conditions.vertical_offset_m_s2

    def with_conditions(self, **changes: Any) -> Self:
        """Return the same filter with other conditions, fields of ``FilterConditions``."""
        return self._with(conditions=replace(self.conditions, **changes))

    def _with(self, **changes: Any) -> Self:
        return type(self)(**{name: getattr(self, name) for name in self.arguments} | changes)

    def memory(self, count: int) -> StorageMemory:
        """Return the memory of n episodes.

        Raises:
            ParameterError: n is no number of episodes.
        """
        count = require_whole("count", count, 1)
        estimate = SwingEstimate(
            count,
            self.segment_count,
            noise_rad=self.conditions.swing_noise_rad,
            drift_rad=self._drift_rad(),
            period_s=self.task.control_period_s,
        )
        return StorageMemory(count, self.conditions.delay_periods, estimate)

    def begin(self, memory: StorageMemory, observation: Array, started: BoolArray) -> None:
        """Let episodes start, (n,), with their first observations, (n, size)."""
        sensed = Sensed.observed(self._layout, observation)
        require_count(len(memory.residual), len(sensed.swing))
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
        require_count(len(memory.residual), len(sensed.swing))
        wished = finite_accelerations(wished_m_s2, len(sensed.swing))
        memory.before = sensed
        if self.conditions.delay_periods:
            sensed = Sensed(*(part.copy() for part in sensed))
            for commands in memory.under_way[:-1]:
                self._advance(self._advancing, commands, memory.residual, sensed, self._room)
        decision = self._decide(wished, sensed, memory.residual, uncertainty)
        memory.under_way[-1] = decision.allowed_m_s2
        return decision

    def conclude(self, observation: Array, memory: StorageMemory) -> Array:
        """Take note of the observations, (n, size), at the end of the period.

        Returns:
            By how much accelerations were others than foreseen, (n, 3) m/s².
        """
        after = Sensed.observed(self._layout, observation)
        require_count(len(memory.residual), len(after.swing))
        surprise = np.empty_like(memory.residual)
        commands, before = memory.under_way[0], memory.before
        self._compare(
            self.setup, commands, before, after, memory.residual, surprise, memory.largest
        )
        memory.concluded = observation, after
        if self.conditions.delay_periods:
            memory.under_way = np.concatenate((memory.under_way[1:], memory.under_way[:1]))
        if self.conditions.swing_noise_rad:
            memory.estimate.update(after.swing, after.swing_rate)
        return surprise

    def inside(self, observation: Array, memory: StorageMemory) -> BoolArray:
        """Whether the swing is within σ and B is below its level, (n,)."""
        swing = np.abs(self._layout.part(np.asarray(observation), "swing")).max(axis=1)
        return (self.storage_shares(observation, memory) <= 1.0) & (swing <= self.sigma_rad)

    def storage_shares(self, observation: Array, memory: StorageMemory) -> Array:
        """Return B over its level, (n,), at the least the noise allows for."""
        sensed, uncertainty = self._estimated(observation, memory)
        if self.conditions.swing_noise_rad:
            sensed = sensed._replace(swing=sensed.swing + np.copysign(uncertainty, sensed.swing))
        shares = np.empty(len(sensed.swing))
        self._store(self.setup, sensed, self._room, shares)
        return shares

    def heights(self, reach_m: Array) -> tuple[Array, Array]:
        """Return the lowest and the highest grasp, (n,) m, that the filter lets the arm go to."""
        shoulder = self.robot.shoulder_height_m
        goal_pitch = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        above = float(ArmKinematics(self.robot).reach_and_height(goal_pitch)[1]) - shoulder
        ends = np.array([height_range(self.setup.limits, reach, above) for reach in reach_m])
        return ends[:, 0] + shoulder, ends[:, 1] + shoulder

    @property
    def braking_m_s2(self) -> float:
        """The vertical acceleration that it counts on for stopping within the arm's range."""
        return BRAKING_SHARE * self.task.max_acceleration_m_s2

    def shares_of(self, swing: Array, swing_rate: Array, yaw_rate: Array) -> Array:
        """Return B over its level, (n,), of swings and rates (n, N) at yaw rates (n,)."""
        sensed = Sensed.empty(len(swing), self.segment_count)
        sensed.swing[:], sensed.swing_rate[:] = swing, swing_rate
        sensed.base_velocity[:, 1] = yaw_rate
        shares = np.empty(len(swing))
        self._store(self.setup, sensed, self._room, shares)
        return shares

    def storage_errors(self, before: Array, after: Array) -> Array:
        """Return how much more B a period brought than its mean acceleration explains, (n,).

        As shares of V_σ, from observations (n, size) without noise before and after it.
        """
        then, now = (Sensed.observed(self._layout, each) for each in (before, after))
        shares = np.empty(len(then.swing))
        self._misjudge(self.setup, then, now, self._room, shares)
        return shares

    def _estimated(self, observation: Array, memory: StorageMemory) -> tuple[Sensed, Array]:
        # a period begins with the observations with which the last one was concluded
        if memory.concluded is not None and memory.concluded[0] is observation:
            sensed = memory.concluded[1]
        else:
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
