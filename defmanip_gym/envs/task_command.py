"""The task acceleration that an action asks for, as far as the speed limit allows it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.feedback_linearization import NominalModel
from defmanip_gym.theory.dynamics.robot_model import ArmLengths, grasp_velocity

Array = NDArray[np.float64]


class FeltInertia(NamedTuple):
    """m̂ of an object from a file, diag(m̃_o11) at rest, kg: forward, to the left and upwards."""

    forward: float
    left: float
    up: float


class LoopConstants(NamedTuple):
    """What the loop in task mode depends on (compiled code takes named tuples)."""

    model: NominalModel
    max_acceleration_m_s2: float
    max_speed_m_s: float
    period_s: float
    arm: ArmLengths
    is_hinged: bool
    inertia: FeltInertia


@compilable
def plant_grasp_velocity(
    loop: LoopConstants, plant: PlantState, i: int
) -> tuple[float, float, float]:
    """Return ẋ_a of episode i in the base frame, m/s."""
    upper, upper_rate = plant.joints[i, 0], plant.joint_rates[i, 0]
    fore, fore_rate = upper + plant.joints[i, 1], upper_rate + plant.joint_rates[i, 1]
    u1, u2 = plant.base_velocity[i, 0], plant.base_velocity[i, 1]
    return grasp_velocity(loop.arm, upper, fore, upper_rate, fore_rate, u1, u2)


@compilable
def task_command(
    loop: LoopConstants, actions: Array, plant: PlantState, i: int
) -> tuple[float, float, float]:
    """Return w of episode i in the base frame, m/s²."""
    forward, left, up = plant_grasp_velocity(loop, plant, i)
    return limited_acceleration(
        actions[i, 0] * loop.max_acceleration_m_s2,
        actions[i, 1] * loop.max_acceleration_m_s2,
        actions[i, 2] * loop.max_acceleration_m_s2,
        forward,
        left,
        up,
        loop.max_speed_m_s,
        loop.period_s,
    )
