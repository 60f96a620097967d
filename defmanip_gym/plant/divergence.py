"""Telling that a simulation has diverged, without MuJoCo's warnings in terminal and log file.

MuJoCo answers a diverged state with a silent reset of the simulation, warning counters included. So
a counter that was set beforehand tells by being zero again; and counters that are not zero keep
MuJoCo from writing MUJOCO_LOG.TXT, which it does at each counter's first warning.
"""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

# contacts are off in plant and rig, so nothing raises this one after a reset
_SENTINEL = mujoco.mjtWarning.mjWARN_CONTACTFULL.value


class DivergenceSentinel:
    """Watches the simulations of a batch.

    Args:
        plant: the batch.

    Attributes:
        counter: zero where a simulation has diverged since it was armed, (n,).
        counters: all of MuJoCo's warning counters, (n, kinds).
    """

    def __init__(self, plant: batch.Batch) -> None:
        self.counters: NDArray[np.int32] = plant.warning[:, :, 1]
        self.counter: NDArray[np.int32] = self.counters[:, _SENTINEL]
        self.arm(np.arange(plant.nsim))

    def arm(self, ids: NDArray[np.intp]) -> None:
        """Watch simulations that have been set to a new state."""
        self.counters[ids] = 1

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Which simulations have diverged since they were armed, (n,)."""
        return self.counter == 0
