"""From actions to generalized forces: what runs between policy and plant in every period."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable, compiled, machine_code
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.felt_force import Felt, FeltForce
from defmanip_gym.envs.task_command import FeltInertia, LoopConstants, task_command
from defmanip_gym.errors import ActionError
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.theory.dynamics.feedback_linearization import (
    FeedbackLinearization,
    StateRoom,
    generalized_forces_at,
)
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import ArmLengths
from defmanip_gym.validation import number_array

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Ids = NDArray[np.intp]


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
        measures_force = config.inner_loop == "measured_force"
        robot = config.believed_robot
        turned = config.payload.yaw_inertia_kgm2  # turns with the base, which feels it as its own
        linearization = FeedbackLinearization(
            replace(robot, base_yaw_inertia_kgm2=robot.base_yaw_inertia_kgm2 + turned),
            None if measures_force else config.payload.believed,
            RedundancyResolution(config.believed_robot, goal_reach_m=reach_m),
        )
        self._constants = LoopConstants(
            model=linearization.model,
            max_acceleration_m_s2=task.max_acceleration_m_s2,
            max_speed_m_s=task.max_speed_m_s,
            period_s=task.control_period_s,
            arm=ArmLengths.of(config.robot),
            is_hinged=config.payload.is_hinged,
            inertia=FeltInertia(*config.payload.felt_inertia_kg),
        )
        actions = np.empty(self._shape)
        segments = config.payload.count
        self._state = StateRoom.empty(len(linearization.model.d_o22))
        plant = PlantState.empty(num_envs, segments)
        self._felt: FeltForce | None = None
        if self._mode == "force":  # whose first environment need not wait for the linearization
            self._scale = machine_code(_scale, self._force_limits, actions, forces)
        else:
            self._linearize = machine_code(
                _linearize, self._constants, actions, plant, self._state, forces
            )
            if measures_force:
                self._felt = FeltForce(self._constants, actions, plant, forces)

    @property
    def feels(self) -> bool:
        """Whether it is to be told what the force sensor reads."""
        return self._felt is not None

    def begin(self, ids: Ids, force_b: Array, swing: Array) -> None:
        """Take note of episodes that begin at rest.

        Args:
            ids: which of them.
            force_b: the first force readings, (n, 3) N.
            swing: φ, (n, N) rad.
        """
        if self._felt is not None:
            self._felt.begin(ids, force_b, swing)

    def feel(self, before: PlantState, plant: PlantState, force_b: Array) -> None:
        """Take note of a period; arguments as for ``FeltForce.note``."""
        if self._felt is not None:
            self._felt.note(before, plant, force_b)

    def get_state(self, plant: PlantState) -> dict[str, Array]:
        """Return what is remembered; where nothing is, the present force as if at rest."""
        if self._felt is not None:
            return self._felt.get_state()
        return Felt.at_rest(plant.grasp_force_b, plant.swing)._asdict()

    def set_state(self, state: dict[str, Array]) -> None:
        """Go on from what ``get_state`` returned."""
        if self._felt is not None:
            self._felt.set_state(state)

    def write_forces(
        self,
        actions: Any,
        plant: PlantState,
        forces: Array,
        *,
        idle: BoolArray | None = None,
    ) -> Array:
        """Write T_r, (n, 4): directly, or from the task acceleration by Eq. (28) or (2).

        Args:
            actions: as given to the environment.
            plant: the true state, whose motion is measured without noise.
            forces: the simulation's ``generalized_forces``, as they were if it raises.
            idle: whose action does not matter, whatever it is, and counts as zero, (n,).

        Returns:
            The actions, (n, k), clipped to [-1, 1].

        Raises:
            ActionError: wrong shape or values that are not finite.
        """
        values = self._numbers(actions)
        if idle is not None:
            values[idle] = 0.0
        if self._mode == "force":
            are_finite = self._scale(self._force_limits, values, forces)
        else:
            are_finite = self._linearize(self._constants, values, plant, self._state, forces)
            if are_finite and self._felt is not None:
                self._felt.add_to(forces, values, plant)
        if not are_finite:
            raise ActionError(
                "action",
                values.tolist() if len(values) == 1 else "an array with NaN or infinity",
                "finite numbers in [-1, 1]",
                "Look for a diverged policy or controller.",
            )
        return values

    def _numbers(self, actions: Any) -> Array:
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
        return values


@compilable
def _clip(actions: Array) -> bool:
    """Clip in place; return whether all values were finite."""
    count, size = actions.shape
    for i in range(count):
        for k in range(size):
            if not math.isfinite(actions[i, k]):
                return False
            if actions[i, k] > 1.0:
                actions[i, k] = 1.0
            elif actions[i, k] < -1.0:
                actions[i, k] = -1.0
    return True


@compiled
def _scale(limits: Array, actions: Array, forces: Array) -> bool:
    are_finite = _clip(actions)
    if are_finite:
        for i in range(len(forces)):
            for k in range(4):
                forces[i, k] = limits[k] * actions[i, k]
    return are_finite


@compiled
def _linearize(
    loop: LoopConstants, actions: Array, plant: PlantState, state: StateRoom, forces: Array
) -> bool:
    if not _clip(actions):
        return False
    # the forces act for a whole period: take them where the motion will be half-way through it
    half = 0.5 * loop.period_s
    for i in range(len(actions)):
        upper_rate = plant.joint_rates[i, 0]
        fore_rate = upper_rate + plant.joint_rates[i, 1]
        u1, u2 = plant.base_velocity[i, 0], plant.base_velocity[i, 1]
        w_forward, w_left, w_up = task_command(loop, actions, plant, i)
        state.velocity[0], state.velocity[1] = u1, u2
        state.velocity[2], state.velocity[3] = upper_rate, fore_rate
        for k in range(len(state.swing)):
            state.swing[k] = plant.swing[i, k] + half * plant.swing_rate[i, k]
            state.velocity[4 + k] = plant.swing_rate[i, k]
        upper = plant.joints[i, 0] + half * plant.joint_rates[i, 0]
        fore = upper + (plant.joints[i, 1] + half * plant.joint_rates[i, 1])
        generalized_forces_at(loop.model, w_forward, w_left, w_up, upper, fore, state, forces, i)
    return True
