"""From actions to generalized forces: what runs between policy and plant in every period."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable, compiled, machine_code
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ActionError
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.feedback_linearization import (
    FeedbackLinearization,
    NominalModel,
    StateRoom,
    generalized_forces_at,
)
from defmanip_gym.theory.dynamics.frames import turned
from defmanip_gym.theory.dynamics.measured_force import add_grasp_force_at, weighed_mass
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import ArmLengths, grasp_velocity
from defmanip_gym.validation import number_array

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Ids = NDArray[np.intp]


class LoopConstants(NamedTuple):
    """What the loop in task mode depends on (compiled code takes named tuples)."""

    model: NominalModel
    max_acceleration_m_s2: float
    max_speed_m_s: float
    period_s: float
    arm: ArmLengths


class FeltForce(NamedTuple):
    """What the inner loop that measures the force remembers (compiled code takes named tuples).

    Copies, since observations are their receivers' to change.

    Attributes:
        force_b: on the object as last read, sensor noise included, (n, 3) N.
    acceleration_b: mean of the grasp's over the last period, (n, 3) m/s².
    mass_kg: of the object, weighed at the start, (n,).
    """

    force_b: Array
    acceleration_b: Array
    mass_kg: Array


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
        self._measures_force = config.inner_loop == "measured_force"
        self._force_limits = np.array(config.robot.force_limits)
        reach_m, _ = config.goal_reach_and_height_m
        linearization = FeedbackLinearization(
            config.believed_robot,
            None if self._measures_force else config.believed_beam,
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
        self._felt = FeltForce(*np.zeros((2, num_envs, 3)), np.zeros(num_envs))
        segments = config.beam.segment_count
        self._state = StateRoom.empty(len(linearization.model.d_o22))
        plant = PlantState.empty(num_envs, segments)
        if self._mode == "force":  # whose first environment need not wait for the linearization
            self._scale = machine_code(_scale, self._force_limits, actions, forces)
        else:
            self._linearize = machine_code(
                _linearize, self._constants, actions, plant, self._state, forces
            )
        if self._mode == "task" and self._measures_force:
            self._add_force = machine_code(
                _add_grasp_force, self._constants, actions, plant, self._felt, forces
            )
            self._feel = machine_code(
                _feel, self._constants, plant, plant, np.empty((num_envs, 3)), self._felt
            )

    def begin(self, ids: Ids, force_b: Array, swing: Array) -> None:
        """Weigh the objects of episodes that begin at rest.

        Args:
            ids: the episodes.
            force_b: first force readings, (n, 3) N.
            swing: φ, (n, N) rad.
        """
        felt, force_b = self._felt, force_b[ids]
        felt.force_b[ids], felt.acceleration_b[ids] = force_b, 0.0
        mass_kg = weighed_mass(force_b[:, 0], force_b[:, 2], swing[ids, 0])
        felt.mass_kg[ids] = np.maximum(mass_kg, 0.0)

    def feel(self, before: PlantState, plant: PlantState, force_b: Array) -> None:
        """Note what a period brought; only the inner loop ``"measured_force"`` needs it.

        Args:
            before: the true state at its beginning.
            plant: and at its end.
            force_b: what the force sensor reads at its end, (n, 3) N.
        """
        self._feel(self._constants, before, plant, np.ascontiguousarray(force_b), self._felt)

    def get_state(self, plant: PlantState) -> dict[str, Array]:
        """Return what was felt last; where it is not noted, the present force as if at rest."""
        felt = self._felt
        if not self._measures_force:
            force_b = plant.grasp_force_b
            mass_kg = np.maximum(force_b[:, 2], 0.0) / GRAVITY_M_S2
            felt = FeltForce(force_b, np.zeros_like(force_b), mass_kg)
        return {name: values.copy() for name, values in felt._asdict().items()}

    def set_state(self, state: dict[str, Array]) -> None:
        """Go on from what ``get_state`` returned."""
        for name, values in self._felt._asdict().items():
            values[:] = state[name]

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
            plant: the true state, whose motion the linearization measures without noise.
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
            if are_finite and self._measures_force:
                self._add_force(self._constants, values, plant, self._felt, forces)
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


@compilable
def _grasp_velocity(
    loop: LoopConstants, plant: PlantState, i: int
) -> tuple[float, float, float]:
    upper, upper_rate = plant.joints[i, 0], plant.joint_rates[i, 0]
    fore, fore_rate = upper + plant.joints[i, 1], upper_rate + plant.joint_rates[i, 1]
    u1, u2 = plant.base_velocity[i, 0], plant.base_velocity[i, 1]
    return grasp_velocity(loop.arm, upper, fore, upper_rate, fore_rate, u1, u2)


@compilable
def _limited(
    loop: LoopConstants, actions: Array, plant: PlantState, i: int
) -> tuple[float, float, float]:
    """Return the w that an action asks for, as far as the speed limit allows it."""
    forward, left, up = _grasp_velocity(loop, plant, i)
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


@compiled
def _linearize(
    loop: LoopConstants, actions: Array, plant: PlantState, state: StateRoom, forces: Array
) -> bool:
    if not _clip(actions):
        return False
    # the forces act for a whole period: take them where the motion will be half-way through it
    half = 0.5 * loop.period_s
    for i in range(len(actions)):
        upper, upper_rate = plant.joints[i, 0], plant.joint_rates[i, 0]
        fore, fore_rate = upper + plant.joints[i, 1], upper_rate + plant.joint_rates[i, 1]
        u1, u2 = plant.base_velocity[i, 0], plant.base_velocity[i, 1]
        w_forward, w_left, w_up = _limited(loop, actions, plant, i)
        state.velocity[0], state.velocity[1] = u1, u2
        state.velocity[2], state.velocity[3] = upper_rate, fore_rate
        for k in range(len(state.swing)):
            state.swing[k] = plant.swing[i, k] + half * plant.swing_rate[i, k]
            state.velocity[4 + k] = plant.swing_rate[i, k]
        upper = plant.joints[i, 0] + half * plant.joint_rates[i, 0]
        fore = upper + (plant.joints[i, 1] + half * plant.joint_rates[i, 1])
        generalized_forces_at(loop.model, w_forward, w_left, w_up, upper, fore, state, forces, i)
    return True


@compiled
def _add_grasp_force(
    loop: LoopConstants,
    actions: Array,
    plant: PlantState,
    felt: FeltForce,
    forces: Array,
) -> None:
    half = 0.5 * loop.period_s  # where the forces are taken, as above
    for i in range(len(forces)):
        upper = plant.joints[i, 0] + half * plant.joint_rates[i, 0]
        fore = upper + (plant.joints[i, 1] + half * plant.joint_rates[i, 1])
        w_forward, w_left, w_up = _limited(loop, actions, plant, i)
        add_grasp_force_at(
            loop.model.arm,
            w_forward,
            w_left,
            w_up,
            upper,
            fore,
            plant.swing[i, 0],
            felt.force_b,
            felt.acceleration_b,
            felt.mass_kg,
            forces,
            i,
        )


@compiled
def _feel(
    loop: LoopConstants,
    before: PlantState,
    plant: PlantState,
    reading_b: Array,
    felt: FeltForce,
) -> None:
    """Note the mean acceleration of a period, base frame of its middle, and the force at its end."""
    for i in range(len(reading_b)):
        half = 0.5 * (plant.base_pose[i, 2] - before.base_pose[i, 2])
        now, then = _grasp_velocity(loop, plant, i), _grasp_velocity(loop, before, i)
        forward, left = turned(now[0], now[1], half)
        forward_then, left_then = turned(then[0], then[1], -half)
        felt.acceleration_b[i, 0] = (forward - forward_then) / loop.period_s
        felt.acceleration_b[i, 1] = (left - left_then) / loop.period_s
        felt.acceleration_b[i, 2] = (now[2] - then[2]) / loop.period_s
        for k in range(3):
            felt.force_b[i, k] = reading_b[i, k]
