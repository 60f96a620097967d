"""What filters ask of whatever is carried, rods or objects of links: chosen when compiled."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from defmanip_gym.compiled import chosen_by_type, compilable
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.linkage_storage import (
    LinkageModel,
    LinkageStorageRoom,
    linkage_power,
    linkage_reversing,
    linkage_step,
    linkage_storage,
)
from defmanip_gym.theory.filters.storage import (
    StorageModel,
    StorageRoom,
    power_of,
    storage_at,
    swing_step,
    uncertain_storage,
)

# StorageModel or LinkageModel, and its room: where code is compiled, it is known which
CarriedModel: TypeAlias = Any
CarriedRoom: TypeAlias = Any


@compilable
def _rod_step(
    model: StorageModel,
    c: int,
    swing: Array,
    swing_rate: Array,
    grasp: tuple[float, float, float],
    yaw_rate: float,
    yaw_acceleration: float,
    period_s: float,
    room: StorageRoom,
) -> None:
    """Step a rod, which feels neither leftward nor yaw acceleration."""
    swing_step(model, c, swing, swing_rate, grasp[0], grasp[2], yaw_rate, period_s, room)


@compilable
def _rod_power(
    model: StorageModel, c: int, yaw_rate: float, reach: float, room: StorageRoom
) -> tuple[float, float, float]:
    """Return −∂Ḃ/∂w of a rod, kg·m/s."""
    forward, upward, inertia = power_of(model, c, room)
    return forward, -yaw_rate * inertia / reach, upward


@compilable
def _certain(
    model: LinkageModel, c: int, uncertainty: Array, i: int, room: LinkageStorageRoom
) -> float:
    """Return nothing: no noise is provided for."""
    return 0.0


@compilable
def _may_reverse(
    model: StorageModel, ahead: float, yaw_rate: float, reach: float, period_s: float
) -> tuple[float, float, float]:
    """Return no limits: rods do not feel what is leftward."""
    return -np.inf, -np.inf, np.inf


step_carried = chosen_by_type({StorageModel: _rod_step, LinkageModel: linkage_step})
stored_in_carried = chosen_by_type({StorageModel: storage_at, LinkageModel: linkage_storage})
power_of_carried = chosen_by_type({StorageModel: _rod_power, LinkageModel: linkage_power})
reversing_with_carried = chosen_by_type(
    {StorageModel: _may_reverse, LinkageModel: linkage_reversing}
)
uncertain_in_carried = chosen_by_type({StorageModel: uncertain_storage, LinkageModel: _certain})
