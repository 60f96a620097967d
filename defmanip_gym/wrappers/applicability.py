"""Whether a filter's promise holds in an environment, and why not, in words.

A filter covers an object under conditions; an environment is a robot with errors, noise,
disturbances, and whatever a user put between wrapper and robot. What the configuration tells is
judged before the first step, what only the motion tells while it lasts.
"""

from __future__ import annotations

from functools import cached_property

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError, ObjectFileError
from defmanip_gym.theory.filters.nu_max_filter import NuMaxFilter
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping
from defmanip_gym.wrappers.nu_max_terms import NuMaxTerms
from defmanip_gym.wrappers.promise import Promise
from defmanip_gym.wrappers.storage_terms import StorageTerms
from defmanip_gym.wrappers.terms import Terms


def require_fit(config: TransportConfig, safety_filter: SafetyFilter) -> None:
    """Raise CertificateError unless the filter is for such an environment at all."""
    if config.control_mode != "task":
        raise CertificateError(
            "control_mode",
            config.control_mode,
            "'task'",
            "A filter changes the task acceleration; make the environment in task mode.",
        )
    if safety_filter.segment_count != config.payload.count:
        raise CertificateError(
            "segment_count of the filter's object",
            safety_filter.segment_count,
            f"{config.payload.count}, as in the environment",
            "Make it for the environment's payload.",
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


class Applicability(Promise):
    """Judges n episodes of an environment.

    Args:
        config: the environment's definition.
        safety_filter: that is enforced.
        count: n.
        action_changers: names of wrappers that may change the allowed actions.
        delay_periods: control periods until an action takes effect.
    """

    def __init__(
        self,
        config: TransportConfig,
        safety_filter: SafetyFilter,
        count: int = 1,
        action_changers: tuple[str, ...] = (),
        delay_periods: int = 0,
    ) -> None:
        super().__init__(safety_filter, _terms(config, safety_filter), count)
        self._config = config
        self._action_changers, self._delay_periods = action_changers, delay_periods

    @cached_property
    def configuration_reason(self) -> str:
        """Why the promise covers no episode of this environment; empty if it may."""
        try:
            carried = self._config.payload.carried
        except ObjectFileError as error:
            return f"it was not computed for what is carried: {error}"
        if not all(map(self._filter.covers, carried)):
            return "it was not computed for what is carried"
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


def _terms(config: TransportConfig, safety_filter: SafetyFilter) -> Terms:
    if isinstance(safety_filter, NuMaxFilter):
        return NuMaxTerms(config, safety_filter.certificate)
    if isinstance(safety_filter, StorageKeeping):
        return StorageTerms(config, safety_filter)
    raise CertificateError(
        "safety_filter", safety_filter, "a filter of this package's family", "See make_filter."
    )
