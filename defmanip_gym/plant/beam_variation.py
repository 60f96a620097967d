"""Beams that differ between the simulations of a batch in damping, mass and length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from operator import attrgetter

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.plant import names
from defmanip_gym.plant.beam_body import segment_of
from defmanip_gym.validation import require_instance

Array = NDArray[np.float64]

_VARIED = ("damping", "mass_kg", "length_m")
_COMMON = tuple(field.name for field in fields(BeamParams) if field.name not in _VARIED)
_common = attrgetter(*_COMMON)
_varied = attrgetter(*_VARIED)


class BeamVariation:
    """Gives simulations of a batch their own beams, by per-simulation model fields.

    A model field becomes per-simulation, which costs time at every step, with the first beam that
    needs it: damping alone needs one field, mass and length most.

    Args:
        plant: the batch, made from a model that holds ``beam``.
        beam: the beam that all simulations carry so far.
    """

    def __init__(self, plant: batch.Batch, beam: BeamParams) -> None:
        self._batch, self._beam = plant, beam
        model, count = plant.model, range(beam.segment_count)
        self._bodies = np.array([model.body(names.segment(index)).id for index in count])
        self._geoms = np.array([model.geom(names.segment_geom(index)).id for index in count])
        self._damper = np.array([model.tendon(names.ROOT_DAMPER).id])
        self._rows: dict[str, Array] = {}  # (n, ...) of the fields that are per-simulation by now

    def set(self, ids: NDArray[np.intp], beams: Sequence[BeamParams]) -> None:
        """Let simulations carry other beams from now on; their states stay as they are.

        Args:
            ids: the simulations, (k,), increasing.
            beams: their beams, k; only damping, mass and length may differ from the first beam's.

        Raises:
            ParameterError: a beam that differs in something else, or ids that do not fit.
        """
        self._check(ids, beams)
        if len(ids) == 0:
            return
        damping, mass, length = np.array([_varied(beam) for beam in beams]).T
        count = self._beam.segment_count
        segment = segment_of(mass / count, length / count, self._beam.radius_m)
        self._write("tendon_damping", ids, self._damper, damping)
        self._write("body_mass", ids, self._bodies, segment.mass_kg)
        self._write("body_inertia", ids, self._bodies, segment.inertia_kgm2)
        self._write("body_ipos", ids, self._bodies, segment.center_m)
        self._write("body_pos", ids, self._bodies[1:], segment.tip_m)
        self._write("geom_pos", ids, self._geoms, segment.center_m)
        self._write("geom_size", ids, self._geoms, segment.capsule_m)
        self._batch.set_const(ids)

    def move_to(self, plant: batch.Batch) -> None:
        """Give another batch's simulations, made from the same model, the same beams."""
        self._batch = plant
        for field, rows in self._rows.items():
            self._rows[field] = plant.expand(field)
            self._rows[field][:] = rows
        if self._rows:
            plant.set_const()

    def write_to(self, model: mujoco.MjModel, index: int) -> None:
        """Give a copy of the model the beam that simulation ``index`` carries, to draw it."""
        for field, rows in self._rows.items():
            getattr(model, field)[:] = rows[index]
        if self._rows:
            model.geom_rbound[self._geoms] = model.geom_size[self._geoms, :2].sum(axis=1)
            mujoco.mj_setConst(model, mujoco.MjData(model))  # cameras refer to centres of mass

    def _write(
        self, field: str, ids: NDArray[np.intp], objects: NDArray[np.intp], values: Array
    ) -> None:
        """Give ``objects`` of simulation ``ids[i]`` the value ``values[i]``, (k, ...)."""
        each = values[:, None]
        if field not in self._rows:
            shared = self._batch.expanded(field) is None
            if shared and (each == getattr(self._batch.model, field)[objects]).all():
                return
            self._rows[field] = self._batch.expand(field)
        self._rows[field][ids[:, None], objects] = each

    def _check(self, ids: NDArray[np.intp], beams: Sequence[BeamParams]) -> None:
        total = self._batch.nsim
        in_range = not len(ids) or (0 <= ids[0] and ids[-1] < total)
        if not in_range or (ids[1:] <= ids[:-1]).any():
            raise ParameterError(
                "ids", ids.tolist(), f"increasing, from 0 to {total - 1}", "Sort ids with beams."
            )
        if len(beams) != len(ids):
            raise ParameterError(
                "beams", len(beams), f"as many as ids, {len(ids)}", "Give each simulation one."
            )
        expected = _common(self._beam)
        for beam in beams:
            require_instance("beams", beam, BeamParams)
            if _common(beam) != expected:
                raise ParameterError(
                    "beams",
                    beam,
                    f"beams that differ from {self._beam!r} in {', '.join(_VARIED)} only",
                    "Make another batch for beams of another make.",
                )
