"""Rods: beams of N segments that hang from a hinge, the compiled special case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError, PayloadError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, BeamRanges
from defmanip_gym.payloads.payload import Coordinate, Payload
from defmanip_gym.payloads.rod_cargo import RodCargo
from defmanip_gym.plant.rod_body import RodBody
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.theory.dynamics.measured_force import ROD_SHARE
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, linearize
from defmanip_gym.validation import plain, require_params, settle

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class RodPayload(Payload):
    """A beam, drawn per episode where ranges say so.

    Attributes:
        beam: the true one, but for what ``beam_ranges`` vary.
        beam_ranges: of its values, from which each episode draws.
        nominal_beam: what a feedback linearization believes; by default the beam without damping at
            the root: overestimated damping destabilizes the swing.

    Raises:
        ParameterError: ranges that do not fit the beam, or a nominal one of other segments.
    """

    beam: BeamParams = field(default_factory=BeamParams)
    beam_ranges: BeamRanges = field(default_factory=BeamRanges)
    nominal_beam: BeamParams | None = None

    def __post_init__(self) -> None:
        settle(self, "beam", require_params, BeamParams)
        settle(self, "beam_ranges", require_params, BeamRanges)
        if self.nominal_beam is not None:
            settle(self, "nominal_beam", require_params, BeamParams)
        self.beam_ranges.require_fit(self.beam)
        nominal = self.nominal_beam
        if nominal is not None and nominal.segment_count != self.beam.segment_count:
            raise ParameterError(
                "nominal_beam.segment_count",
                nominal.segment_count,
                f"{self.beam.segment_count}, the true beam's",
                "The controller observes one angle per true segment.",
            )

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """φ of each segment, rad from the vertical."""
        return tuple(
            Coordinate(name=f"segment {index + 1}", unit="rad", rest=0.0)
            for index in range(self.beam.segment_count)
        )

    @property
    def identity(self) -> dict[str, Any]:
        """Its parameters."""
        return asdict(self)

    @property
    def known(self) -> dict[str, Any]:
        """The given beam."""
        return {"beam": plain(self.beam)}

    @property
    def linear(self) -> LinearizedObject:
        """Of the given beam."""
        return linearize(self.beam)

    @property
    def mass_kg(self) -> float:
        """Of the given beam."""
        return self.beam.mass_kg

    @property
    def carried(self) -> tuple[BeamParams, ...]:
        """The beams at the ends of the ranges."""
        return self.beam_ranges.extremes(self.beam)

    @property
    def extremes(self) -> tuple[RodPayload, ...]:
        """Each of these beams, believed to be what they are all believed to be."""
        return tuple(
            RodPayload(beam=beam, nominal_beam=self.believed)
            for beam in dict.fromkeys(self.carried)
        )

    @property
    def slowest_rad_s(self) -> float:
        """√(3 g / 2 l), a stiff rod's."""
        return math.sqrt(1.5 * GRAVITY_M_S2 / self.beam.length_m)

    @property
    def felt_inertia_kg(self) -> tuple[float, float, float]:
        """As of one uniform rod, however many segments there are; in episodes with its weight."""
        mass_kg = self.beam.mass_kg
        return ROD_SHARE * mass_kg, mass_kg, mass_kg

    @property
    def yaw_inertia_kgm2(self) -> float:
        """None to speak of: it hangs."""
        return 0.0

    @property
    def believed(self) -> BeamParams:
        """What a feedback linearization believes."""
        return replace(self.beam, damping=0.0) if self.nominal_beam is None else self.nominal_beam

    @property
    def is_hinged(self) -> bool:
        """It does."""
        return True

    def body(self) -> RodBody:
        """Return how MuJoCo holds it."""
        return RodBody(self.beam)

    def cargo(self, simulation: Simulation, generators: Sequence[np.random.Generator]) -> RodCargo:
        """Return the rods of n episodes."""
        return RodCargo(self.beam, self.beam_ranges, simulation, generators)

    def swung(self, swing_rad: Array) -> Array:
        """Return straight rods."""
        return np.repeat(swing_rad[:, None], self.beam.segment_count, axis=1)


def rod_of(payload: Payload) -> RodPayload:
    """Return a payload for what knows rods only.

    Raises:
        PayloadError: it is another one.
    """
    if not isinstance(payload, RodPayload):
        raise PayloadError(
            "payload",
            type(payload).__name__,
            "a rod",
            "This is known for rods only; the controller field and filters for objects take any.",
        )
    return payload


def beam_payload(beam: BeamParams | None) -> RodPayload:
    """Return the payload of a beam, the reference one by default."""
    return RodPayload() if beam is None else RodPayload(beam=beam)
