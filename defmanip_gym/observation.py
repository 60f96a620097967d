"""What the observation vector holds, by name; shared by environment, wrappers and controllers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError

# Scale of near_offset_b. Networks see observations normalized by their spread, and centimetres
# drown in a spread of metres.
NEAR_OFFSET_SCALE_M = 0.5


@dataclass(frozen=True)
class ObservationField:
    """A named part of the observation."""

    name: str
    size: int
    unit: str
    meaning: str


@dataclass(frozen=True)
class ObservationLayout:
    """Order of the observation of a beam with ``segment_count`` segments.

    Of an object from a file, ``segment_count`` is the number N of its coordinates, ``swing`` z2 and
    ``swing_rate`` ż2: the file's joint positions in their order, rad or m, wherever they swing.

    ``_b`` marks components in the base frame: forward, left, up.
    """

    segment_count: int

    @cached_property
    def fields(self) -> tuple[ObservationField, ...]:
        """The parts in order."""
        count = self.segment_count
        return (
            ObservationField("goal_offset_b", 3, "m", "goal minus grasp position"),
            ObservationField("heading", 2, "-", "sine and cosine of θ − θ_goal"),
            ObservationField("grasp_velocity_b", 3, "m/s", "velocity of the grasp"),
            ObservationField("base_velocity", 2, "m/s, rad/s", "u1, u2"),
            ObservationField("joints", 2, "rad", "q1, q2"),
            ObservationField("joint_rates", 2, "rad/s", "q̇1, q̇2"),
            ObservationField("swing", count, "rad", "φ of each segment, from the vertical"),
            ObservationField("swing_rate", count, "rad/s", "φ̇ of each segment"),
            ObservationField("grasp_force_b", 3, "N", "measured force on the object"),
            ObservationField("near_offset_b", 3, "-", "tanh of goal_offset_b over 0.5 m"),
        )

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Where each part lies."""
        stops = np.cumsum([field.size for field in self.fields]).tolist()
        return {
            field.name: slice(stop - field.size, stop)
            for field, stop in zip(self.fields, stops, strict=True)
        }

    @property
    def size(self) -> int:
        """Length of the observation."""
        return sum(field.size for field in self.fields)

    def part(self, observation: NDArray[np.float64], name: str) -> NDArray[np.float64]:
        """Return the named part of observations (..., size), as a view."""
        return observation[..., self.slices[name]]

    @staticmethod
    def of_size(size: int) -> ObservationLayout:
        """Return the layout whose observations have ``size`` entries.

        Raises:
            ParameterError: no number of segments gives that size.
        """
        constant = ObservationLayout(0).size
        count, rest = divmod(size - constant, 2)
        if rest or count < 1:
            raise ParameterError(
                "observation size",
                size,
                f"{constant} + 2 N for N >= 1 segments",
                "This is not an observation of DeformTransport.",
            )
        return ObservationLayout(count)
