"""When a storage filter covers an environment: errors, noise, the storage at the start."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping, StorageMemory
from defmanip_gym.wrappers.filter_errors import filter_errors

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_AXES = ("forward", "lateral", "vertical")


class WatchedTerms:
    """What of a storage filter's terms is judged while episodes last, wherever they are.

    Args:
        safety_filter: that is enforced.
    """

    def __init__(self, safety_filter: StorageKeeping) -> None:
        self._filter = safety_filter
        self.method = safety_filter.name
        self.delay_periods = safety_filter.conditions.delay_periods
        self._provided = np.array((*safety_filter.errors_m_s2, *safety_filter.offsets_m_s2))

    @property
    def outside_reason(self) -> str:
        """What is said of an episode that starts outside, until it is inside."""
        return "the object stores more than the filter's level; it applies once it does not"

    def start_reason(self, observation: Array, i: int) -> str:
        """Return nothing: every start is provided for, if not inside then later."""
        return ""

    def broken(
        self, surprise: Array, observation: Array, memory: StorageMemory
    ) -> tuple[BoolArray, Callable[[int], str]]:
        """Return where a period broke the terms, (n,), and what to say of an episode."""
        provided = self._provided
        if (memory.largest <= provided).all():
            return np.zeros(len(surprise), dtype=bool), str
        sizes = np.abs(np.concatenate((surprise, memory.residual), axis=1))

        def reason(i: int) -> str:
            worst = int(np.argmax(sizes[i] / np.maximum(provided, 1e-12)))
            what = "changed by" if worst < len(_AXES) else "was off by"
            return (
                f"in a control period the {_AXES[worst % len(_AXES)]} acceleration {what} "
                f"{sizes[i, worst]:.3g} m/s² beside what was foreseen; the filter provides for "
                f"{provided[worst]:.3g}"
            )

        broken = np.logical_not((sizes <= provided).all(axis=1))
        return np.asarray(broken, dtype=bool), reason


class StorageTerms(WatchedTerms):
    """Under which terms a storage filter's promise holds in an environment.

    Args:
        config: the environment's definition.
        safety_filter: that is enforced.
    """

    def __init__(self, config: TransportConfig, safety_filter: StorageKeeping) -> None:
        super().__init__(safety_filter)
        self._config = config

    @cached_property
    def configuration_reason(self) -> str:
        """Why the filter covers no episode of this environment; empty if it may.

        Raises:
            CertificateError: the search for errors would take too long.
        """
        config, conditions = self._config, self._filter.conditions
        noise = config.largest_disturbance.swing_sensor_noise_rad
        if noise > conditions.swing_noise_rad:
            return (
                f"swing angles are measured with noise of {noise:.3g} rad; the filter provides for "
                f"{conditions.swing_noise_rad:.3g}"
            )
        for name, given, known in (
            ("max_speed_m_s", config.task, self._filter.task),
            ("max_acceleration_m_s2", config.task, self._filter.task),
        ):
            if getattr(given, name) != getattr(known, name):
                return (
                    f"{name} is {getattr(given, name):g}; the filter was made for "
                    f"{getattr(known, name):g}"
                )
        errors = filter_errors(config, self._filter)
        for name, found, provided in (
            ("errors", errors.acceleration_m_s2, self._filter.errors_m_s2),
            ("offsets", errors.offset_m_s2, self._filter.offsets_m_s2),
        ):
            for axis in range(3):
                if found[axis] > provided[axis]:
                    return (
                        f"robot, beam, periods and beliefs of this environment make {_AXES[axis]} "
                        f"{name} of up to {found[axis]:.3g} m/s²; the filter provides for "
                        f"{provided[axis]:.3g}"
                    )
        if errors.storage > conditions.storage_error:
            return (
                f"a control period may bring {errors.storage:.3g} of V_σ more than is foreseen; "
                f"the filter provides for {conditions.storage_error:.3g}"
            )
        return ""
