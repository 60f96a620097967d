"""A controller that brings its safety filter along."""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import Controller, State
from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.filters.safety_filter import SafetyFilter

Array = NDArray[np.float64]


class FilteredController:
    """Asks for what a filter allows of a controller's wishes; the environment needs none around.

    Whether the filter's promise applies is judged by the wrapper around an environment, which
    knows it; this one knows observations only.

    Args:
        controller: whose actions are filtered.
        safety_filter: that they pass.
    """

    def __init__(self, controller: Controller, safety_filter: SafetyFilter) -> None:
        self.controller, self.safety_filter = controller, safety_filter

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return the allowed action and (the controller's state, the filter's memory).

        Raises:
            ActionError: the controller's wishes are not finite or of another shape.
            ParameterError: observations of another size or number, or other than as many starts.
        """
        below, remembered = (None, None) if state is None else state
        wished, below = self.controller.predict(observation, below, episode_start, deterministic)
        seen = np.ascontiguousarray(np.atleast_2d(observation), dtype=np.float64)
        started = np.zeros(len(seen), dtype=bool)
        if episode_start is not None:
            started |= _starts(episode_start, len(seen))
        if remembered is None:
            memory, started = self.safety_filter.memory(len(seen)), ~np.zeros_like(started)
        else:
            memory = copy.deepcopy(remembered)  # what was returned stays as it was
            self.safety_filter.conclude(seen, memory)
        if started.any():
            self.safety_filter.begin(memory, seen, started)
        limit = self.safety_filter.task.max_acceleration_m_s2
        asked = limit * np.clip(np.atleast_2d(wished), -1.0, 1.0)
        allowed = self.safety_filter.certify_action(asked, seen, memory).allowed_m_s2 / limit
        return allowed.reshape(wished.shape), (below, memory)


def _starts(episode_start: object, count: int) -> NDArray[np.bool_]:
    """Return which of n episodes start, (n,) or one for all."""
    starts = np.atleast_1d(np.asarray(episode_start, dtype=bool))
    if starts.shape not in ((1,), (count,)):
        raise ParameterError(
            "episode_start", starts.shape, f"an array of shape {(count,)}", "One for each row."
        )
    return starts
