"""The objects of n episodes: all that of the file."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import StateError
from defmanip_gym.objects.internal_forces import CARRIAGE, InternalForces
from defmanip_gym.objects.mjcf_object import MjcfObject
from defmanip_gym.params import GRAVITY_M_S2

Array = NDArray[np.float64]
Ids = NDArray[np.intp]


class MjcfCargo:
    """What the simulations carry.

    Args:
        thing: the object.
        count: number of episodes.
    """

    told: tuple[str, ...] = ()

    def __init__(self, thing: MjcfObject, count: int) -> None:
        self._forces = InternalForces(thing.object_file)
        self._weight = np.array([0.0, 0.0, thing.object_file.mass_kg * GRAVITY_M_S2])
        self.values = np.empty((0, count))

    def draw(self, ids: Ids) -> None:
        """Leave the objects as they are."""

    def forces_at_rest(self, ids: Ids, z2: Array) -> Array:
        """Return the force (10) on objects at z2, (k, N), from a grasp held still, (k, 3) N."""
        forces = np.empty((len(ids), 3))
        for row, each in enumerate(z2):
            matrix = self._forces.mass_matrix(each)
            inner = slice(CARRIAGE, None)
            acceleration = np.linalg.solve(matrix[inner, inner], -self._forces(each))
            forces[row] = self._weight + matrix[:3, inner] @ acceleration
        return forces

    def get_state(self) -> None:
        """Return nothing: nothing is drawn."""

    def fitting(self, state: Any) -> None:
        """Raise StateError unless a state tells of nothing drawn."""
        if state is not None:
            raise StateError(
                "state['beams']",
                state,
                "None: this object is the same in all episodes",
                "Take it from get_state of an environment with the same payload.",
            )

    def set_state(self, state: Any) -> None:
        """Go on with the object."""
