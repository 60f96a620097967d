"""Normalized actions through a safety filter, with a count of what it changed."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.wrappers.actions import finite_actions
from defmanip_gym.wrappers.applicability import Applicability, require_fit

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Changes of a command below this (m/s²) are rounding.
ROUNDING_M_S2 = 1e-9


class Filtered(NamedTuple):
    """What became of n actions.

    Attributes:
        wished: as asked for, clipped to [-1, 1], (n, 3).
        applied: what the environment gets, (n, 3).
        correction_m_s2: how far apart they are, (n,).
        margin: the filter's, (n,).
    """

    wished: Array
    applied: Array
    correction_m_s2: Array
    margin: Array

    @classmethod
    def nothing(cls, count: int) -> Filtered:
        """Return what is told before the first action."""
        zeros = np.zeros((count, 3))
        return cls(zeros, zeros, np.zeros(count), np.full(count, np.nan))


class Filtering:
    """Puts batches of normalized actions through a filter and counts what it changed.

    Args:
        config: the environment's definition.
        safety_filter: that is enforced.
        count: n.
        action_changers: wrappers between here and the environment that may change actions.
        delay_periods: control periods until an action takes effect.

    Raises:
        CertificateError: the filter does not fit the environment.
    """

    remembers = ("_memory", "_applicability", "steps", "interventions", "total_correction_m_s2")

    def __init__(
        self,
        config: TransportConfig,
        safety_filter: SafetyFilter,
        count: int = 1,
        action_changers: tuple[str, ...] = (),
        delay_periods: int = 0,
    ) -> None:
        require_fit(config, safety_filter)
        self._filter, self._memory = safety_filter, safety_filter.memory(count)
        self._limit = config.task.max_acceleration_m_s2
        self._applicability = Applicability(
            config, safety_filter, count, action_changers, delay_periods
        )
        self.steps = 0
        self.interventions = 0
        self.total_correction_m_s2 = 0.0

    @property
    def specification(self) -> dict[str, Any]:
        """The filter's, as JSON values."""
        return self._filter.specification

    @property
    def applies(self) -> BoolArray:
        """Whether the filter's promise covers the episodes as far as is known by now, (n,)."""
        return self._applicability.applies

    @property
    def reasons(self) -> NDArray[np.object_]:
        """Why it does not, in words, (n,); empty where it does."""
        return self._applicability.reasons

    def begin(self, observation: Array, started: BoolArray) -> None:
        """Forget the past of episodes that start.

        Args:
            observation: first observations, (n, size); rows that do not start are not looked at.
            started: which episodes start, (n,).
        """
        if started.any():
            self._filter.begin(self._memory, observation, started)
            self._applicability.begin(observation, self._memory, started)

    def certify(self, actions: Any, observation: Array, idle: BoolArray | None = None) -> Filtered:
        """Return what becomes of actions.

        Args:
            actions: normalized, (n, 3).
            observation: what the environment last returned, (n, size).
            idle: episodes whose actions do not matter, (n,); none by default.

        Raises:
            ActionError: actions that are not finite or of another shape.
        """
        awake = np.ones(len(observation), dtype=bool) if idle is None else ~idle
        wished = np.minimum(np.maximum(finite_actions(actions, awake), -1.0), 1.0)
        decision = self._filter.certify_action(self._limit * wished, observation, self._memory)
        change = decision.allowed_m_s2 - self._limit * wished
        correction = np.sqrt(np.einsum("ij,ij->i", change, change))
        if idle is not None:
            correction[idle] = 0.0
        self.steps += int(np.count_nonzero(awake))
        self.interventions += int(np.count_nonzero(correction > ROUNDING_M_S2))
        self.total_correction_m_s2 += float(correction.sum())
        return Filtered(wished, decision.allowed_m_s2 / self._limit, correction, decision.margin)

    def conclude(self, observation: Array, idle: BoolArray | None = None) -> None:
        """Compare the motion with what was foreseen, and with what the filter provides for.

        Args:
            observation: at the end of the period, before any reset, (n, size).
            idle: as for ``certify``.
        """
        surprise = self._filter.conclude(observation, self._memory)
        self._applicability.watch(surprise, observation, self._memory, idle)

    @property
    def intervention_rate(self) -> float:
        """Share of steps whose action was changed."""
        return self.interventions / max(self.steps, 1)
