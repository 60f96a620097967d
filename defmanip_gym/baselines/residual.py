"""Residual learning: a network corrects the paper's controller instead of replacing it.

T. Johannink et al., "Residual reinforcement learning for robot control", ICRA 2019.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import Controller, State
from defmanip_gym.validation import require_number, require_whole

Array = NDArray[np.float64]

_MOST_PERIODS = 1000


def required_periods(decision_periods: object) -> int:
    """Return for how many control periods a decision is held, or raise ParameterError."""
    return require_whole("decision_periods", decision_periods, 1, _MOST_PERIODS)


def corrected(base: Array, residual: Array, authority: float) -> Array:
    """Return the base's normalized actions plus a residual's within ``authority``, (n, 3)."""
    return np.clip(base + authority * np.clip(residual, -1.0, 1.0), -1.0, 1.0)


class ResidualController:
    """A controller plus a small correction, decided on now and then and held in between.

    Args:
        base: decides what is corrected.
        residual: a policy without state, on the same observations.
        authority: largest correction of a normalized action, in (0, 1].
        decision_periods: control periods between two decisions of the residual.

    Raises:
        ParameterError: arguments out of range.
    """

    def __init__(
        self, base: Controller, residual: Controller, *, authority: float, decision_periods: int
    ) -> None:
        self.base, self.residual = base, residual
        self.authority = require_number("authority", authority, 1e-9, 1.0)
        self.decision_periods = required_periods(decision_periods)

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return the corrected action and (base's state, held residual, periods it is held for)."""
        below, held, periods = (None, None, None) if state is None else state
        action, below = self.base.predict(observation, below, episode_start, deterministic)
        decided, _ = self.residual.predict(observation, None, episode_start, deterministic)
        if held is None:
            held, periods = decided, np.zeros(action.shape[:-1], dtype=np.int64)
        elif episode_start is not None:
            periods = np.where(episode_start, 0, periods)
        held = np.where(np.expand_dims(periods == 0, -1), decided, held)
        following = (periods + 1) % self.decision_periods
        return corrected(action, held, self.authority), (below, held, following)
