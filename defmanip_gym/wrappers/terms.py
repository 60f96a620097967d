"""What the judgement of a filter's promise asks of each member of the family."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Terms(Protocol):
    """Under which terms one filter's promise holds in one environment."""

    method: str
    delay_periods: int

    @property
    def configuration_reason(self) -> str:
        """Why it covers no episode, as far as robot, noise and errors tell; empty if it may."""
        ...

    @property
    def outside_reason(self) -> str:
        """What is said of an episode that starts outside, until it is inside."""
        ...

    def start_reason(self, observation: Array, i: int) -> str:
        """Return why the start of episode i, in observations (n, size), is not provided for."""
        ...

    def broken(
        self, surprise: Array, observation: Array, memory: Any
    ) -> tuple[BoolArray, Callable[[int], str]]:
        """Return where a period broke the terms, (n,), and what to say of an episode."""
        ...
