"""When a filter for objects covers what a robot on the rig carries (``objects.rig_robot``)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import CertificateError
from defmanip_gym.theory.filters.limits import RobotLimits
from defmanip_gym.theory.filters.object_filter import ObjectStorageFilter
from defmanip_gym.theory.payload.linkage import Linkage
from defmanip_gym.wrappers.promise import Promise
from defmanip_gym.wrappers.storage_terms import WatchedTerms

Array = NDArray[np.float64]


class RigTerms(WatchedTerms):
    """The terms of a storage filter, of which all but the configuration is judged as it goes."""

    configuration_reason = ""


class RigPromise(Promise):
    """Judges n episodes of an object on the rig.

    Args:
        carried: the object there.
        limits: of the robot that carries it.
        safety_filter: that is enforced.
        count: n.
        delay_periods: control periods until a command takes effect.

    Raises:
        CertificateError: the filter is for another number of coordinates.
    """

    def __init__(
        self,
        carried: Linkage,
        limits: RobotLimits,
        safety_filter: ObjectStorageFilter,
        count: int = 1,
        delay_periods: int = 0,
    ) -> None:
        if safety_filter.segment_count != len(carried.mass):
            raise CertificateError(
                "segment_count of the filter's object",
                safety_filter.segment_count,
                f"{len(carried.mass)}, as on the rig",
                "Make it for that object: object_filter_for(...).",
            )
        super().__init__(safety_filter, RigTerms(safety_filter), count)
        self._carried, self._limits, self._delay_periods = carried, limits, delay_periods
        self._made = safety_filter

    @property
    def configuration_reason(self) -> str:
        """Why the promise covers no episode there; empty if it may."""
        if not self._made.covers(self._carried):
            return "it was not computed for the object that is carried"
        if self._delay_periods != self._terms.delay_periods:
            return (
                f"commands take effect {self._delay_periods} control periods late; it provides for "
                f"{self._terms.delay_periods}"
            )
        if not _equal(self._limits, self._made.setup.limits):
            return "it was made for a robot with other limits"
        return ""


def _equal(one: RobotLimits, other: RobotLimits) -> bool:
    return all(a == b for a, b in zip(one, other, strict=True))
