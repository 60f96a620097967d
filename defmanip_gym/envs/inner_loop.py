"""From actions to generalized forces: what runs between policy and plant in every period."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compiled, machine_code
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ActionError
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.theory.control_laws import limit_speed_at
from defmanip_gym.theory.feedback_linearization import (
    FeedbackLinearization,
    NominalModel,
    generalized_forces_at,
)
from defmanip_gym.theory.redundancy import RedundancyResolution
from defmanip_gym.theory.robot_model import ArmLengths, grasp_velocity
from defmanip_gym.validation import number_array

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class LoopConstants(NamedTuple):
    """What the loop in task mode depends on (compiled code takes named tuples)."""

    model: NominalModel
    max_acceleration_m_s2: float
    max_speed_m_s: float
    period_s: float
    arm: ArmLengths


class InnerLoop:
    """Turns actions of n episodes into the generalized forces T_r of Eq. (2).

    Args:
        config: the environment's definition.
        forces: where they will be written, (n, 4).
    """

    def __init__(self, config: TransportConfig, forces: Array) -> None:
        num_envs = len(forces)
        self._mode, task = config.control_mode, config.task
        self.action_size = 3 if self._mode == "task" else 4
        self._shape = (num_envs, self.action_size)
        self._force_limits = np.array(config.robot.force_limits)
        reach_m, _ = config.goal_reach_and_height_m
        linearization = FeedbackLinearization(
            config.believed_robot,
            config.believed_beam,
            RedundancyResolution(config.believed_robot, goal_reach_m=reach_m),
        )
        self._constants = LoopConstants(
            model=linearization.model,
            max_acceleration_m_s2=task.max_acceleration_m_s2,
            max_speed_m_s=task.max_speed_m_s,
            period_s=task.control_period_s,
            arm=ArmLengths.of(config.robot),
        )
        actions = np.empty(self._shape)
        state = PlantState.empty(num_envs, config.beam.segment_count)
        self._clip = machine_code(_clip, actions)
        if self._mode == "force":  # whose first environment need not wait for the linearization
            self._scale = machine_code(_scale, self._force_limits, actions, forces)
        else:
            self._linearize = machine_code(_linearize, self._constants, actions, state, forces)

    def clipped(self, actions: Any, idle: BoolArray | None = None) -> Array:
        """Return the actions, (n, k), clipped to [-1, 1].

        Args:
            actions: as given to the environment.
            idle: whose action does not matter, whatever it is, and counts as zero, (n,).

        Raises:
            ActionError: wrong shape or values that are not finite.
        """
        values = number_array(actions)
        if values is None:
            raise ActionError(
                "action", actions, f"numbers of shape {self._shape}", "Pass a NumPy array."
            )
        if values.shape != self._shape:
            raise ActionError(
                "action shape",
                values.shape,
                f"{self._shape} in {self._mode!r} control mode",
                "Check the environment's action_space.",
            )
        if idle is not None:
            values[idle] = 0.0
        if not self._clip(values):
            raise ActionError(
                "action",
                values.tolist() if len(values) == 1 else "an array with NaN or infinity",
                "finite numbers in [-1, 1]",
                "Look for a diverged policy or controller.",
            )
        return values

    def write_forces(self, actions: Array, plant: PlantState, forces: Array) -> None:
        """Write T_r, (n, 4): directly, or from the task acceleration by Eq. (28).

        Args:
            actions: clipped, (n, k).
            plant: the true state, which the feedback linearization measures without noise.
            forces: the simulation's ``generalized_forces``.
        """
        if self._mode == "force":
            self._scale(self._force_limits, actions, forces)
        else:
            self._linearize(self._constants, actions, plant, forces)


@compiled
def _clip(actions: Array) -> bool:
    """Clip in place; return whether all values were finite."""
    for i in range(actions.shape[0]):
        for k in range(actions.shape[1]):
            if not np.isfinite(actions[i, k]):
                return False
            actions[i, k] = min(max(actions[i, k], -1.0), 1.0)
    return True


@compiled
def _scale(limits: Array, actions: Array, forces: Array) -> None:
    for i in range(forces.shape[0]):
        for k in range(4):
            forces[i, k] = limits[k] * actions[i, k]


@compiled
def _linearize(loop: LoopConstants, actions: Array, plant: PlantState, forces: Array) -> None:
    # the forces act for a whole period: take them where the motion will be half-way through it
    half = 0.5 * loop.period_s
    w, velocity = np.empty(3), np.empty(3)
    joints, swing = np.empty(2), np.empty(plant.swing.shape[1])
    for i in range(len(actions)):
        for k in range(3):
            w[k] = actions[i, k] * loop.max_acceleration_m_s2
        upper, upper_rate = plant.joints[i, 0], plant.joint_rates[i, 0]
        fore, fore_rate = upper + plant.joints[i, 1], upper_rate + plant.joint_rates[i, 1]
        u1, u2 = plant.base_velocity[i, 0], plant.base_velocity[i, 1]
        velocity[0], velocity[1], velocity[2] = grasp_velocity(
            loop.arm, upper, fore, upper_rate, fore_rate, u1, u2
        )
        limit_speed_at(w, velocity, loop.max_speed_m_s, loop.period_s)
        for k in range(2):
            joints[k] = plant.joints[i, k] + half * plant.joint_rates[i, k]
        for k in range(len(swing)):
            swing[k] = plant.swing[i, k] + half * plant.swing_rate[i, k]
        generalized_forces_at(
            loop.model,
            w,
            joints,
            plant.joint_rates[i],
            plant.base_velocity[i],
            swing,
            plant.swing_rate[i],
            forces[i],
        )
