"""A payload: what controllers, filters, plant and evaluation have to know of what is carried.

One method more is one file more: ``RodPayload`` in ``rod.py``, ``MjcfPayload`` in ``mjcf.py``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.params import BeamParams
from defmanip_gym.plant.payload_body import PayloadBody
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject

Array = NDArray[np.float64]
Ids = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """An internal coordinate.

    Attributes:
        name: of it.
        unit: ``"rad"`` or ``"m"``.
        rest: where it is at the equilibrium (12).
    """

    name: str
    unit: str
    rest: float


class Cargo(Protocol):
    """What the simulations of n episodes carry, as far as episodes differ.

    Attributes:
        told: names of ``values`` in ``info``.
        values: (len(told), n); replaced, never written.
    """

    told: tuple[str, ...]
    values: Array

    def draw(self, ids: Ids) -> None:
        """Let new episodes, (k,) increasing, have payloads of their own, or the given one again."""

    def forces_at_rest(self, ids: Ids, z2: Array) -> Array:
        """Return the force on payloads at z2, (k, N), whose grasp is held still, (k, 3) N."""

    def get_state(self) -> Array | None:
        """Return what was drawn, a row for each episode, or None where nothing was."""

    def fitting(self, state: Any) -> Any:
        """Return a state for ``set_state``; raise InvalidValueError if it does not fit."""

    def set_state(self, state: Any) -> None:
        """Carry what ``fitting`` returned."""


class Payload(ABC):
    """What a robot carries; hashable and compared by value."""

    @property
    @abstractmethod
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The internal coordinates z2, in the order of the observation's ``swing``."""

    @property
    def count(self) -> int:
        """Their number N."""
        return len(self.coordinates)

    @property
    @abstractmethod
    def identity(self) -> dict[str, Any]:
        """What tells it from others, as JSON values."""

    @property
    @abstractmethod
    def known(self) -> dict[str, Any]:
        """What a controller knows that is made for it, as JSON values."""

    @property
    @abstractmethod
    def linear(self) -> LinearizedObject:
        """Its small motions about the equilibrium, as everybody believes them."""

    @property
    @abstractmethod
    def mass_kg(self) -> float:
        """Mass of all of it, as everybody believes it."""

    @property
    @abstractmethod
    def carried(self) -> tuple[object, ...]:
        """What a filter has to cover: all that episodes may carry, or the ends of its ranges."""

    @property
    @abstractmethod
    def extremes(self) -> tuple[Payload, ...]:
        """The payloads at the ends of what episodes draw, each known exactly."""

    @property
    @abstractmethod
    def slowest_rad_s(self) -> float:
        """Angular frequency of the slowest small motion about the equilibrium."""

    @property
    def felt_inertia_kg(self) -> tuple[float, float, float]:
        """m̂ that the loop around the measured force puts in, forward, left, up: diag(m̃_o11)."""
        linear = self.linear
        follows = np.linalg.solve(linear.m_o22, linear.m_o12.T)
        forward, left, up = np.diag(linear.m_o11 - linear.m_o12 @ follows).tolist()
        return forward, left, up

    @property
    @abstractmethod
    def yaw_inertia_kgm2(self) -> float:
        """About the vertical through the grasp, at rest, as far as the base reckons with it."""

    @property
    @abstractmethod
    def believed(self) -> BeamParams | None:
        """The rod that a feedback linearization (28) can be made for; None where there is none."""

    @property
    @abstractmethod
    def is_hinged(self) -> bool:
        """Whether it hangs from a hinge at the grasp as a rod does, along its first coordinate."""

    @abstractmethod
    def body(self) -> PayloadBody:
        """Return how MuJoCo holds it."""

    @abstractmethod
    def cargo(self, simulation: Simulation, generators: Sequence[np.random.Generator]) -> Cargo:
        """Return what n episodes carry.

        Args:
            simulation: of the n episodes; what it carries follows the draws.
            generators: one for each episode, looked up anew at every draw.
        """

    @abstractmethod
    def swung(self, swing_rad: Array) -> Array:
        """Return z2, (k, N), of starts that swing by (k,) from the equilibrium."""
