"""The controller interface: SB3's ``predict``, so that SB3 models are controllers as they are."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = tuple[Any, ...]


class Controller(Protocol):
    """Maps observations to normalized actions, batched or one at a time."""

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return action and next internal state.

        Args:
            observation: (n, size) or (size,).
            state: what the previous call returned; None at the very beginning.
            episode_start: (n,), which episodes begin with this observation.
            deterministic: ask stochastic policies for their mean action.
        """
        ...


class ZeroController:
    """Asks for no acceleration at all.

    Args:
        action_size: length of the action.
    """

    def __init__(self, action_size: int = 3) -> None:
        self.action_size = action_size

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return zeros."""
        return np.zeros((*observation.shape[:-1], self.action_size)), state


class RandomController:
    """Draws uniform actions; the draws depend on seed and call count, not on batching order.

    Args:
        seed: of its own generator.
        action_size: length of the action.
    """

    def __init__(self, seed: int = 0, action_size: int = 3) -> None:
        self._generator = np.random.default_rng(seed)
        self.action_size = action_size

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return uniform actions in [-1, 1]."""
        shape = (*observation.shape[:-1], self.action_size)
        return self._generator.uniform(-1.0, 1.0, shape), state
