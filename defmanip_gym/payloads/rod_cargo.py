"""The rods of n episodes: drawn anew for each, if they are to differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import machine_code
from defmanip_gym.params import BeamParams, BeamRanges
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.state_tree import fitted
from defmanip_gym.theory.payload.object_model import HangingBeam, held_forces

Array = NDArray[np.float64]
Ids = NDArray[np.intp]

VARIED = ("damping", "mass_kg", "length_m")


class RodCargo:
    """What the simulations carry.

    Args:
        beam: the given one.
        ranges: to draw from.
        simulation: of the n episodes; its beams follow the draws.
        generators: one for each episode, looked up anew at every draw.

    Attributes:
        told: names of ``values`` in ``info``.
        values: ``VARIED`` of each episode's beam, (3, n); replaced, never written.
    """

    told = tuple(f"beam_{name}" for name in VARIED)

    def __init__(
        self,
        beam: BeamParams,
        ranges: BeamRanges,
        simulation: Simulation,
        generators: Sequence[np.random.Generator],
    ) -> None:
        self._beam, self._ranges = beam, ranges
        self._simulation, self._generators = simulation, generators
        count = simulation.count
        self._all = np.arange(count)
        self._given = _rows([beam]).T
        self.values: Array = np.tile(self._given, count)
        self._object = HangingBeam(beam)
        segments = beam.segment_count
        self._room = np.empty((segments, segments)), np.empty(segments)
        self._held_forces = machine_code(
            held_forces,
            self._object.chain.constants,
            self._object.k_o22,
            np.empty(1),
            np.empty(1),
            np.empty((1, segments)),
            *self._room,
            np.empty((1, 3)),
        )

    def draw(self, ids: Ids) -> None:
        """Let new episodes, (k,) increasing, have beams of their own, or the given one again."""
        if self._ranges.is_empty:
            if self._is_foreign:
                self._carry(ids, [self._beam] * len(ids))
            return
        self._carry(ids, [self._ranges.sample(self._beam, self._generators[i]) for i in ids])

    def forces_at_rest(self, ids: Ids, swing: Array) -> Array:
        """Return the force on beams that swing from a grasp at rest, base frame, (k, 3) N.

        Args:
            ids: the episodes, (k,).
            swing: of their segments, (k, N) rad.
        """
        _, mass_kg, length_m = self.values[:, ids]
        force_b = np.empty((len(ids), 3))
        self._held_forces(
            self._object.chain.constants,
            self._object.k_o22,
            mass_kg / self._beam.mass_kg,
            length_m / self._beam.length_m,
            swing,
            *self._room,
            force_b,
        )
        return force_b

    def get_state(self) -> Array | None:
        """Return the beams' values, (n, 3), or None where all are the given one."""
        return self.values.T.copy() if self._is_foreign else None

    def fitting(self, state: Any) -> list[BeamParams] | None:
        """Return the beams of a state, n, or None where they are those carried now.

        Raises:
            StateError: it is of another number of episodes.
            ParameterError: it holds values that no beam has.
        """
        if state is None:  # of an environment that carried its given beam: this one's then
            return [self._beam] * len(self._all) if self._is_foreign else None
        rows = fitted("state['beams']", state, self.values.T)
        return [replace(self._beam, **dict(zip(VARIED, row, strict=True))) for row in rows.tolist()]

    def set_state(self, beams: list[BeamParams] | None) -> None:
        """Carry what ``fitting`` returned."""
        if beams is not None:
            self._carry(self._all, beams)

    @property
    def _is_foreign(self) -> bool:
        return bool((self.values != self._given).any())

    def _carry(self, ids: Ids, beams: list[BeamParams]) -> None:
        self._simulation.carry(ids, beams)
        self.values = self.values.copy()
        self.values[:, ids] = _rows(beams).T


def _rows(beams: Sequence[BeamParams]) -> Array:
    return np.array([[getattr(beam, name) for name in VARIED] for beam in beams])
