"""``storage``: V ≤ V_σ kept by the command nearest to the wished one (Lemma III.1 as a barrier)."""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams, validated_sigma
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.reserves import (
    estimate_drift_rad,
    hanging_modes,
    largest_momenta,
    reserved_shares,
)
from defmanip_gym.theory.filters.safety_filter import FilterProof
from defmanip_gym.theory.filters.storage import StorageModel
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping
from defmanip_gym.validation import require_params

_EDGE_POINTS = 1001


class StorageFilter(StorageKeeping):
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
    arguments: tuple[str, ...] = (
        "beam",
        "sigma_rad",
        "robot",
        "task",
        "conditions",
        "intervals",
    )

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
        self.segment_count = self.beam.segment_count
        self.equilibrium = np.zeros(self.segment_count)
        self._beams = StorageModel.of(self.intervals.corners(self.beam), self.sigma_rad)
        if self.conditions.delay_periods and len(self._beams.passes) > 1:
            raise CertificateError(
                "delay_periods with intervals of length or stiffness",
                self.conditions.delay_periods,
                "0, or a beam of which these are known exactly",
                "Through a delay only one beam is foreseen.",
            )
        self._prepare(self._beams, largest_momenta(self._beams), None)

    def _reserved_shares(self) -> Array:
        return reserved_shares(
            self._beams,
            self.beam,
            sigma_rad=self.sigma_rad,
            conditions=self.conditions,
            task=self.task,
        )

    def _drift_rad(self) -> float:
        return estimate_drift_rad(self.beam, self.pass_j, self.task.control_period_s)

    def for_beam(self, beam: BeamParams) -> Self:
        """Return the same filter for another beam, known exactly."""
        return self._with(beam=beam, intervals=PayloadIntervals())

    def for_carried(self, carried: object) -> Self:
        """Return the same filter for a beam, known exactly."""
        return self.for_beam(require_params("carried", carried, BeamParams))

    def modes(self) -> tuple[Array, Array]:
        """Return natural frequencies, (N,) rad/s, ascending, and shapes, (N, N), about hanging."""
        return hanging_modes(self.beam)

    def covers(self, carried: object) -> bool:
        """Whether it holds for this beam: the believed one within the intervals, however damped."""
        return isinstance(carried, BeamParams) and self.intervals.cover(self.beam, carried)

    def edge(self) -> tuple[Array, Array] | None:
        """Return the upper edge (φ, φ̇) of the set that it keeps, one hinge only, else None."""
        if self.segment_count != 1:
            return None
        level, moment = float(self.setup.levels[0]), float(self._beams.moments[0, 0])
        stiffness = float(self._beams.stiffness[0, 0, 0])
        swing = np.linspace(-self.sigma_rad, self.sigma_rad, _EDGE_POINTS)
        potential = GRAVITY_M_S2 * moment * (1 - np.cos(swing)) + 0.5 * stiffness * swing**2
        inertia = float(self._beams.inertia[0, 0] + self._beams.coupling[0, 0, 0])
        kept = potential <= level
        return swing[kept], np.sqrt(2 * (level - potential[kept]) / inertia)
