"""Residual learning: a network corrects the paper's controller instead of replacing it.

T. Johannink et al., "Residual reinforcement learning for robot control", ICRA 2019.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import Controller, State
from defmanip_gym.errors import ParameterError

Array = NDArray[np.float64]


def corrected(base: Array, residual: Array, authority: float) -> Array:
    """Return the base's normalized actions plus a residual's within ``authority``, (n, 3)."""
    return np.clip(base + authority * np.clip(residual, -1.0, 1.0), -1.0, 1.0)


class ResidualController:
    """A controller plus a small correction.

    Args:
        base: decides what is corrected; the state is its own.
        residual: a policy without state, on the same observations.
        authority: largest correction of a normalized action, in (0, 1].

    Raises:
        ParameterError: an authority out of range.
    """

    def __init__(self, base: Controller, residual: Controller, *, authority: float) -> None:
        if not 0.0 < authority <= 1.0:
            raise ParameterError("authority", authority, "0 < authority <= 1", "Choose a share.")
        self.base, self.residual, self.authority = base, residual, authority

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return the corrected action and the base's next state."""
        action, state = self.base.predict(observation, state, episode_start, deterministic)
        residual, _ = self.residual.predict(observation, None, episode_start, deterministic)
        return corrected(action, residual, self.authority), state
