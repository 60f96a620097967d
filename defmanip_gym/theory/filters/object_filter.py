"""``object_storage``: V ≤ V_σ for any object of links, swinging in any direction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.params import GRAVITY_M_S2, RobotParams, validated_sigma
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height_slopes
from defmanip_gym.theory.filters.conditions import LARGEST_ERROR, FilterConditions
from defmanip_gym.theory.filters.linkage_bounds import bounded, linkage_modes
from defmanip_gym.theory.filters.linkage_storage import LinkageStorageRoom
from defmanip_gym.theory.filters.safety_filter import BoolArray, FilterProof
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping, StorageMemory
from defmanip_gym.theory.payload.linkage import HeldLinkage, Linkage, require_linkage
from defmanip_gym.validation import (
    plain,
    require_between,
    require_number,
    require_params,
    require_positive,
    settle,
)

_NEGLIGIBLE = 1e-6


@dataclass(frozen=True, kw_only=True)
class ObjectConditions(FilterConditions):
    """Errors and delay that a filter for objects makes room for; angles without noise.

    Attributes:
        lateral_offset_m_s2: how far the offset to the side may be from zero: objects feel it.
        reversing_share: of V_σ, what turning while reversing may bring in half a swing to the side;
            |u1 + 2ρ̇| |u2| is kept that small.
    """

    lateral_offset_m_s2: float = 0.2
    reversing_share: float = 0.08

    def __post_init__(self) -> None:
        super().__post_init__()
        settle(self, "lateral_offset_m_s2", require_number, 0.0, LARGEST_ERROR, "m/s²")
        settle(self, "reversing_share", require_between, 0.0, 1.0)
        if self.swing_noise_rad:
            raise CertificateError(
                "swing_noise_rad",
                self.swing_noise_rad,
                "0 rad for objects of links",
                "What uncertain coordinates store is known for rods only.",
            )


class ObjectStorageFilter(StorageKeeping):
    """Keeps B = V + ½ u2² (I_σ − I_z) + μ |u2| below a level under V_σ: ‖z2‖∞ ≤ σ.

    It counts on no damping. What a search finds are V_σ, I_σ and μ, so the promise is one for the
    object with these.

    Args:
        linkage: the object that is carried, as ``MjcfObject.linkage`` returns it, or its fields.
        mass_kg: of the object with what the gripper holds.
        sigma_rad: σ, for each coordinate (rad or m).
        robot: that carries it.
        task: its limits and control period.
        conditions: errors and delay that it makes room for.

    Attributes:
        equilibrium: z2*, (N,).
        coordinate: index of the coordinate that is at σ at the lowest pass.

    Raises:
        CertificateError: there is no V_σ, or errors leave nothing of it.
    """

    name = "object_storage"
    proof: FilterProof = "nominal"
    arguments = ("linkage", "mass_kg", "sigma_rad", "robot", "task", "conditions")

    def __init__(
        self,
        linkage: Linkage,
        *,
        mass_kg: float,
        sigma_rad: float = math.pi / 6,
        robot: RobotParams = RobotParams(),
        task: TaskParams = TaskParams(),
        conditions: ObjectConditions = ObjectConditions(),
    ) -> None:
        self.linkage = require_linkage("linkage", linkage)
        self.mass_kg = require_positive("mass_kg", mass_kg, "kg")
        self.sigma_rad = validated_sigma(sigma_rad)
        self.robot = require_params("robot", robot, RobotParams)
        self.task = require_params("task", task, TaskParams)
        self.conditions: ObjectConditions = require_params(
            "conditions", conditions, ObjectConditions
        )
        self.segment_count = len(self.linkage.mass)
        self._object, self._bounds = bounded(self.linkage, self.mass_kg, self.sigma_rad)
        self.equilibrium, self.coordinate = self._bounds.equilibrium, self._bounds.coordinate
        momentum = np.array([np.linalg.norm(self._bounds.momenta)])
        if self._feels_the_side:
            self._object = self._object._replace(reversing=self._free_while_reversing())
        self._prepare(self._object, momentum, LinkageStorageRoom.empty(self.segment_count))

    @property
    def _feels_the_side(self) -> bool:
        _, left, _ = self._bounds.momenta
        felt = max(left, float(self._object.yaw_momentum[0]))
        return bool(felt > _NEGLIGIBLE * self._bounds.momenta.max())

    @property
    def specification(self) -> dict[str, Any]:
        """What the filter was made with, as JSON values."""
        return super().specification | {"linkage": plain_linkage(self.linkage)}

    def modes(self) -> tuple[Array, Array]:
        """Return natural frequencies, (N,) rad/s, ascending, and shapes, (N, N), about z2*."""
        return linkage_modes(self._object, self.equilibrium)

    def for_carried(self, carried: object) -> ObjectStorageFilter:
        """Return this filter: it is for one object, known exactly."""
        return self

    @property
    def offsets_m_s2(self) -> tuple[float, float, float]:
        """Offsets of acceleration that it provides for: forward, to the side, upwards."""
        conditions = self.conditions
        return (
            conditions.forward_offset_m_s2,
            conditions.lateral_offset_m_s2,
            conditions.vertical_offset_m_s2,
        )

    def _free_while_reversing(self) -> Array:
        """Return |u1 + 2ρ̇| |u2|, (1,) m/s², that in half a swing stores no more than its share."""
        slowest, sideways = self._bounds.slowest_rad_s, max(self._bounds.momenta[1], 1e-12)
        left_j = self.conditions.reversing_share * float(self._object.passes[0])
        return np.array([left_j * slowest / (2 * sideways)])

    def inside(self, observation: Array, memory: StorageMemory) -> BoolArray:
        """Whether coordinates are within σ, B below its level, and it does not jackknife, (n,)."""
        sensed = Sensed.observed(self._layout, observation)
        slopes = reach_and_height_slopes(self.setup.limits.arm, *sensed.pitch.T)
        ahead = sensed.velocity_b[:, 0]
        for slope, rate in zip(slopes[:2], sensed.pitch_rate.T, strict=True):
            ahead = ahead + slope * rate
        turning = np.maximum(-ahead, 0.0) * np.abs(sensed.base_velocity[:, 1])
        free = float(self._object.reversing[0])
        within: BoolArray = super().inside(observation, memory) & (turning <= free)
        return within

    def covers(self, carried: object) -> bool:
        """Whether it holds for this object: a ``Linkage``, or a held one, with the same numbers."""
        if isinstance(carried, HeldLinkage):
            return carried.mass_kg == self.mass_kg and self.covers(carried.linkage)
        return isinstance(carried, Linkage) and all(
            np.array_equal(own, other) for own, other in zip(self.linkage, carried, strict=True)
        )

    def _reserved_shares(self) -> Array:
        """Return the share of V_σ that errors and delay cost, (1,), as of rods."""
        conditions, period_s = self.conditions, self.task.control_period_s
        momenta, pass_j = self._bounds.momenta, self.pass_j
        per_period = period_s * float(momenta @ np.array(self.errors_m_s2))
        offsets = period_s * float(momenta @ np.array(self.offsets_m_s2))
        at_the_limit = 2 * (offsets + per_period)
        swinging_rad = self._bounds.slowest_rad_s * period_s
        ripple = conditions.storage_error * pass_j / swinging_rad
        delay = conditions.delay_periods
        delayed = sum(min(j * per_period, 2 * offsets) for j in range(1, delay + 1))
        delayed += delay * conditions.storage_error * pass_j
        largest = self.task.max_acceleration_m_s2
        pull = GRAVITY_M_S2 * math.sin(self.sigma_rad) + largest
        moving = float(self.linkage.mass.sum())
        between = period_s**2 / 8 * moving * pull * math.sqrt(3.0) * largest
        share = (at_the_limit + ripple + delayed + between) / pass_j
        return np.array([share + conditions.reversing_share * self._feels_the_side])


def plain_linkage(linkage: Linkage) -> dict[str, Any]:
    """Return a linkage as JSON holds it."""
    return {name: plain(value) for name, value in linkage._asdict().items()}
