"""An object from a file at the end of the arm, in a gripper that parallel rods keep level.

What holds the gripper level pulls at its pitch, q1 + q2 + q3: its torque reaches the base by the
rods, and the arm feels the force at the grasp alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.compiled import compiled
from defmanip_gym.errors import PayloadError
from defmanip_gym.params import RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.beam_body import add_pitch_hinge, set_inertia
from defmanip_gym.plant.object_copy import add_drawn_geoms, add_object
from defmanip_gym.plant.object_file import ObjectFile
from defmanip_gym.plant.plant_state import PlantState, read_robot

Array = NDArray[np.float64]

# N·m/rad and N·m·s/rad: 20 N·m tilt it by a thousandth of a degree
_LEVEL_STIFFNESS, _LEVEL_DAMPING = 1e6, 1e4
_NEARLY_NOTHING = 1e-9  # MuJoCo wants every moving body to have mass


@compiled
def read_held(
    ids: NDArray[np.intp], position: Array, velocity: Array, force_s: Array, state: PlantState
) -> None:
    """Fill in the state for MuJoCo's qpos and qvel.

    Args:
        ids: the simulations to read.
        position: x, y, θ, q1, q2, the wrist's angle and z2, (n, 6 + N).
        velocity: their rates, (n, 6 + N).
        force_s: on the object at the grasp, (n, 3) N in the gripper's frame, which is level.
        state: to be filled in.
    """
    _, count = state.swing.shape
    for row in range(len(ids)):
        i = ids[row]
        read_robot(i, position, velocity, state)
        for k in range(count):
            state.swing[i, k] = position[i, 6 + k]
            state.swing_rate[i, k] = velocity[i, 6 + k]
        for k in range(3):
            state.grasp_force_b[i, k] = force_s[i, k]


@compiled
def sense_held(ids: NDArray[np.intp], position: Array, force_b: Array, force_s: Array) -> None:
    """Write forces in the base frame, (k, 3) N, as the level sensor has them."""
    for row in range(len(ids)):
        for k in range(3):
            force_s[ids[row], k] = force_b[row, k]


class HeldObject:
    """Holds an object at its grasp site.

    Args:
        object_file: the object.
    """

    def __init__(self, object_file: ObjectFile) -> None:
        self.read, self.sense = read_held, sense_held
        self._file = object_file
        self.count = len(object_file.coordinates)
        self._geoms: tuple[str, ...] = ()

    def attach(
        self, spec: mujoco.MjSpec, forearm: mujoco.MjsBody, robot: RobotParams
    ) -> mujoco.MjsBody:
        """Hang it from a gripper at the forearm's end and return the gripper."""
        gripper = forearm.add_body(name=names.GRIPPER, pos=[robot.forearm.length_m, 0.0, 0.0])
        add_pitch_hinge(gripper, names.WRIST)
        set_inertia(gripper, _NEARLY_NOTHING, [0.0, 0.0, 0.0], [_NEARLY_NOTHING] * 3)
        level = spec.add_tendon(name=names.LEVEL_RODS)
        level.stiffness[0], level.damping[0] = _LEVEL_STIFFNESS, _LEVEL_DAMPING
        level.springlength = [0.0, 0.0]
        for joint in (names.SHOULDER, names.ELBOW, names.WRIST):
            level.wrap_joint(joint, 1.0)
        held = self._file.held
        bodies = add_object(
            spec, gripper, held, grasp_site=self._file.grasp_site, grasp_m=self._file.grasp_m
        )
        self._geoms = add_drawn_geoms(spec, bodies, held)
        return gripper

    def positions(self, joints: Array, z2: Array) -> Array:
        """Return the wrist's angle and z2, (k, 1 + N)."""
        return np.concatenate((-(joints[:, :1] + joints[:, 1:]), z2), axis=1)

    def geoms(self, model: mujoco.MjModel) -> list[int]:
        """Return all that is drawn of the object."""
        return [model.geom(name).id for name in self._geoms]

    def variation(self, plant: batch.Batch) -> SameObject:
        """Return what keeps the object the same in all simulations."""
        return SameObject()


class SameObject:
    """All simulations of a batch carry the object of the file."""

    def set(self, ids: NDArray[np.intp], things: Sequence[Any]) -> None:
        """Refuse other objects."""
        if len(things):
            raise PayloadError(
                "things",
                things,
                "none: objects from files do not vary",
                "Use one environment each.",
            )

    def move_to(self, plant: batch.Batch) -> None:
        """Go on with another batch of the same model."""

    def write_to(self, model: mujoco.MjModel, index: int) -> None:
        """Leave a copy of the model as it is."""
