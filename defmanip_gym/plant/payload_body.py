"""What hangs from the end of the arm in MuJoCo, whatever it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.params import RobotParams

Array = NDArray[np.float64]


class Variation(Protocol):
    """What differs between the simulations of a batch in what they carry."""

    def set(self, ids: NDArray[np.intp], things: Sequence[Any]) -> None:
        """Let simulations carry others from now on; their states stay as they are."""

    def move_to(self, plant: batch.Batch) -> None:
        """Give another batch's simulations, made from the same model, the same ones."""

    def write_to(self, model: mujoco.MjModel, index: int) -> None:
        """Give a copy of the model what simulation ``index`` carries, to draw it."""


class PayloadBody(Protocol):
    """How MuJoCo holds a payload, and where in its coordinates z2 is.

    Attributes:
        count: number N of internal coordinates.
        read: compiled, as ``read_rod``: fills in a ``PlantState`` from qpos, qvel and the force
            sensor's reading.
        sense: compiled, as ``sense_rod``: the reading that a force in the base frame would give.
    """

    count: int
    read: Any
    sense: Any

    def attach(
        self, spec: mujoco.MjSpec, forearm: mujoco.MjsBody, robot: RobotParams
    ) -> mujoco.MjsBody:
        """Hang it from the forearm's end and return the body whose pull the force sensor reads."""

    def positions(self, joints: Array, z2: Array) -> Array:
        """Return what follows (x, y, θ, q1, q2) in qpos, (k, M).

        It is linear, so that rates of joints and z2 give what follows in qvel.

        Args:
            joints: q_a, (k, 2) rad.
            z2: (k, N).
        """

    def geoms(self, model: mujoco.MjModel) -> list[int]:
        """Return the geoms that turn red as it deforms."""

    def variation(self, plant: batch.Batch) -> Variation:
        """Return what lets the simulations of a batch carry different ones."""
