"""The grasp force as the inner loop ``"measured_force"`` feels it, and what it remembers of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compiled, machine_code
from defmanip_gym.envs.task_command import LoopConstants, plant_grasp_velocity, task_command
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.theory.dynamics.frames import turned
from defmanip_gym.theory.dynamics.measured_force import (
    add_force_at,
    add_grasp_force_at,
    weighed_mass,
)

Array = NDArray[np.float64]
Ids = NDArray[np.intp]


class Felt(NamedTuple):
    """What is remembered of n episodes (compiled code takes named tuples).

    Copies, since observations are their receivers' to change.

    Attributes:
        force_b: on the object as last read, sensor noise included, (n, 3) N.
        acceleration_b: mean of the grasp's over the last period, (n, 3) m/s².
        mass_kg: of the object, weighed at the start, (n,).
    """

    force_b: Array
    acceleration_b: Array
    mass_kg: Array

    @classmethod
    def at_rest(cls, force_b: Array, swing: Array) -> Felt:
        """Return what objects at rest, hanging at φ (n, N) rad, let the sensor read, (n, 3) N."""
        mass_kg = weighed_mass(force_b[:, 0], force_b[:, 2], swing[:, 0])
        return cls(force_b.copy(), np.zeros_like(force_b), np.maximum(mass_kg, 0.0))


class FeltForce:
    """Adds J_Aᵀ (F + m̂ (w − ẍ_a)) to the forces that the robot alone would need.

    Args:
        loop: constants of the inner loop.
        actions: normalized, (n, 3).
        plant: states of the n episodes.
        forces: T_r, (n, 4).
    """

    def __init__(
        self, loop: LoopConstants, actions: Array, plant: PlantState, forces: Array
    ) -> None:
        count = len(forces)
        self._loop = loop
        self._felt = Felt(np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count))
        self._add = machine_code(_add, loop, actions, plant, self._felt, forces)
        self._note = machine_code(_note, loop, plant, plant, np.empty((count, 3)), self._felt)

    def begin(self, ids: Ids, force_b: Array, swing: Array) -> None:
        """Weigh the rods of episodes that begin at rest; arguments as for ``Felt.at_rest``.

        What others show of their mass is their file's: swung against springs, they weigh wrong.
        """
        hanging = swing[ids] if self._loop.is_hinged else np.zeros((len(ids), 1))
        for own, new in zip(self._felt, Felt.at_rest(force_b[ids], hanging), strict=True):
            own[ids] = new

    def note(self, before: PlantState, plant: PlantState, force_b: Array) -> None:
        """Note what a period brought.

        Args:
            before: the true state at its beginning.
            plant: and at its end.
            force_b: what the force sensor reads at its end, (n, 3) N.
        """
        self._note(self._loop, before, plant, np.ascontiguousarray(force_b), self._felt)

    def add_to(self, forces: Array, actions: Array, plant: PlantState) -> None:
        """Add to T_r of the robot alone, (n, 4)."""
        self._add(self._loop, actions, plant, self._felt, forces)

    def get_state(self) -> dict[str, Array]:
        """Return what is remembered."""
        return {name: values.copy() for name, values in self._felt._asdict().items()}

    def set_state(self, state: dict[str, Array]) -> None:
        """Go on from what ``get_state`` returned."""
        for name, values in self._felt._asdict().items():
            values[:] = state[name]


@compiled
def _add(loop: LoopConstants, actions: Array, plant: PlantState, felt: Felt, forces: Array) -> None:
    half = 0.5 * loop.period_s  # positions where the forces are taken, as in the inner loop
    for i in range(len(forces)):
        upper = plant.joints[i, 0] + half * plant.joint_rates[i, 0]
        fore = upper + (plant.joints[i, 1] + half * plant.joint_rates[i, 1])
        w_forward, w_left, w_up = task_command(loop, actions, plant, i)
        if loop.is_hinged:
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
        else:
            late = felt.acceleration_b
            add_force_at(
                loop.model.arm,
                felt.force_b[i, 0] + loop.inertia.forward * (w_forward - late[i, 0]),
                felt.force_b[i, 1] + loop.inertia.left * (w_left - late[i, 1]),
                felt.force_b[i, 2] + loop.inertia.up * (w_up - late[i, 2]),
                upper,
                fore,
                forces,
                i,
            )


@compiled
def _note(
    loop: LoopConstants, before: PlantState, plant: PlantState, reading_b: Array, felt: Felt
) -> None:
    """Note a period's mean acceleration, base frame of its middle, and the force at its end."""
    for i in range(len(reading_b)):
        half = 0.5 * (plant.base_pose[i, 2] - before.base_pose[i, 2])
        now, then = plant_grasp_velocity(loop, plant, i), plant_grasp_velocity(loop, before, i)
        forward, left = turned(now[0], now[1], half)
        forward_then, left_then = turned(then[0], then[1], -half)
        felt.acceleration_b[i, 0] = (forward - forward_then) / loop.period_s
        felt.acceleration_b[i, 1] = (left - left_then) / loop.period_s
        felt.acceleration_b[i, 2] = (now[2] - then[2]) / loop.period_s
        for k in range(3):
            felt.force_b[i, k] = reading_b[i, k]
