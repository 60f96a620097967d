"""Whether a filter's promise holds in episodes, and why not, in words: judged as they go."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.wrappers.terms import Terms

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Promise(ABC):
    """Judges n episodes under a filter, wherever they are.

    Args:
        safety_filter: that is enforced.
        terms: under which its promise holds there.
        count: n.

    Attributes:
        reasons: why the filter's promise does not cover the episodes, in words, (n,); empty where
            it does as far as is known by now.
    """

    remembers = ("words", "_is_outside")  # of which the rest follows

    def __init__(self, safety_filter: SafetyFilter, terms: Terms, count: int) -> None:
        self._filter, self._terms = safety_filter, terms
        self.reasons = np.full(count, "", dtype=object)
        self._applies = np.ones(count, dtype=bool)
        self._is_outside = np.zeros(count, dtype=bool)

    @property
    def applies(self) -> BoolArray:
        """Whether the promise covers the episodes as far as is known by now, (n,)."""
        return self._applies.copy()

    @property
    def words(self) -> list[str]:
        """The same as a list."""
        return list(self.reasons)

    @words.setter
    def words(self, words: list[str]) -> None:
        self.reasons = np.array(words, dtype=object)
        self._note()

    def begin(self, observation: Array, memory: Any, started: BoolArray) -> None:
        """Judge episodes at their start.

        Args:
            observation: the first ones, (n, size).
            memory: the filter's, which has begun.
            started: which episodes start, (n,).
        """
        self.reasons[started] = self.configuration_reason
        self._is_outside[started] = False
        self._note()
        for i in np.flatnonzero(started & self._applies).tolist():
            self.reasons[i] = self._terms.start_reason(observation, i)
        self._note()
        if (started & self._applies).any():
            inside = self._filter.inside(observation, memory)
            self._is_outside |= started & self._applies & ~inside
            self.reasons[started & self._is_outside] = self._terms.outside_reason
            self._note()

    def watch(
        self, surprise: Array, observation: Array, memory: Any, idle: BoolArray | None
    ) -> None:
        """Judge a control period by what it brought.

        Args:
            surprise: accelerations beside those foreseen, (n, 3) m/s².
            observation: at its end, (n, size).
            memory: the filter's, which has concluded it.
            idle: episodes that only go along, (n,).
        """
        watched = self._applies | self._is_outside
        if idle is not None:
            watched &= ~idle
        if not watched.any():
            return
        broken, reason_of = self._terms.broken(surprise, observation, memory)
        for i in np.flatnonzero(broken & watched).tolist():
            self.reasons[i], self._is_outside[i], self._applies[i] = reason_of(i), False, False
        if self._is_outside.any():
            returned = self._is_outside & self._filter.inside(observation, memory)
            self.reasons[returned], self._is_outside[returned] = "", False
            self._applies |= returned

    def _note(self) -> None:
        self._applies = self.reasons == ""

    @property
    @abstractmethod
    def configuration_reason(self) -> str:
        """Why the promise covers no episode there; empty if it may."""
