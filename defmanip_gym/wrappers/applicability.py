"""Whether a filter's promise holds in an environment, and why not, in words.

A filter covers an object under conditions; an environment is a robot with errors, noise,
disturbances, and whatever a user put between wrapper and robot. What the configuration tells is
judged before the first step, what only the motion tells while it lasts.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError
from defmanip_gym.theory.filters.nu_max_filter import NuMaxFilter
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.nu_max_terms import NuMaxTerms
from defmanip_gym.wrappers.storage_terms import StorageTerms
from defmanip_gym.wrappers.terms import Terms

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def require_fit(config: TransportConfig, safety_filter: SafetyFilter) -> None:
    """Raise CertificateError unless the filter is for such an environment at all."""
    if config.control_mode != "task":
        raise CertificateError(
            "control_mode",
            config.control_mode,
            "'task'",
            "A filter changes the task acceleration; make the environment in task mode.",
        )
    if safety_filter.segment_count != config.beam.segment_count:
        raise CertificateError(
            "segment_count of the filter's object",
            safety_filter.segment_count,
            f"{config.beam.segment_count}, as in the environment",
            "Make it for the environment's beam.",
        )
    if safety_filter.sigma_rad > config.sigma_rad:
        raise CertificateError(
            "sigma_rad of the filter",
            safety_filter.sigma_rad,
            f"at most the environment's {config.sigma_rad:.6g}",
            "Make it with the environment's sigma_rad.",
        )
    if safety_filter.task.control_period_s != config.task.control_period_s:
        raise CertificateError(
            "task.control_period_s of the filter",
            safety_filter.task.control_period_s,
            f"{config.task.control_period_s}, the environment's",
            "Make it with the environment's task.",
        )


class Applicability:
    """Judges n episodes of an environment.

    Args:
        config: the environment's definition.
        safety_filter: that is enforced.
        count: n.
        action_changers: names of wrappers that may change the allowed actions.
        delay_periods: control periods until an action takes effect.

    Attributes:
        reasons: why the filter's promise does not cover the episodes, in words, (n,); empty where
            it does as far as is known by now.
    """

    remembers = ("words", "_is_outside")  # of which the rest follows

    def __init__(
        self,
        config: TransportConfig,
        safety_filter: SafetyFilter,
        count: int = 1,
        action_changers: tuple[str, ...] = (),
        delay_periods: int = 0,
    ) -> None:
        self._config, self._filter = config, safety_filter
        self._action_changers, self._delay_periods = action_changers, delay_periods
        self._terms = _terms(config, safety_filter)
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

    @cached_property
    def configuration_reason(self) -> str:
        """Why the promise covers no episode of this environment; empty if it may."""
        if not all(self._filter.covers(beam) for beam in self._beams):
            return "it was not computed for the beams that are carried"
        if self._filter.proof == "none":
            return f"what {self._terms.method!r} allows is not proven"
        if self._action_changers:
            return f"{' and '.join(self._action_changers)} may change the allowed actions"
        if self._delay_periods != self._terms.delay_periods:
            return (
                f"actions take effect {self._delay_periods} control periods late (ActionDelay); it "
                f"provides for {self._terms.delay_periods}"
            )
        try:
            return self._terms.configuration_reason
        except CertificateError as error:
            return f"its errors are not known: {error}"

    @property
    def _beams(self) -> tuple[Any, ...]:
        """The beams that may be carried: what a filter covers are intervals, so ends tell."""
        return self._config.beam_ranges.extremes(self._config.beam)


def _terms(config: TransportConfig, safety_filter: SafetyFilter) -> Terms:
    if isinstance(safety_filter, NuMaxFilter):
        return NuMaxTerms(config, safety_filter.certificate)
    if isinstance(safety_filter, StorageFilter):
        return StorageTerms(config, safety_filter)
    raise CertificateError(
        "safety_filter", safety_filter, "a filter of this package's family", "See make_filter."
    )
