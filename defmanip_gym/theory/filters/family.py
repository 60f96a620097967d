"""The members of the family by name, and filters from their specifications."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.filters.backup_filter import BackupFilter
from defmanip_gym.theory.filters.nu_max_filter import NuMaxFilter
from defmanip_gym.theory.filters.object_filter import ObjectStorageFilter
from defmanip_gym.theory.filters.qp_filter import CbfQpFilter
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.validation import require_choice

# those that are made for an object with conditions and intervals
STORAGE_FILTERS: dict[str, type[StorageFilter]] = {
    kind.name: kind for kind in (StorageFilter, BackupFilter)
}
# the literature's, to compare with
REFERENCE_FILTERS: dict[str, type[StorageFilter]] = {CbfQpFilter.name: CbfQpFilter}
FILTERS: dict[str, type[SafetyFilter]] = {
    NuMaxFilter.name: NuMaxFilter,
    **STORAGE_FILTERS,
    **REFERENCE_FILTERS,
    ObjectStorageFilter.name: ObjectStorageFilter,  # for objects from files, not for rods
}


def require_filter(name: str, value: object) -> SafetyFilter:
    """Return a filter, or the one that a ``specification`` describes.

    Raises:
        ParameterError: neither of them.
    """
    if isinstance(value, SafetyFilter):
        return value
    if not isinstance(value, Mapping) or "name" not in value:
        raise ParameterError(
            name, value, "a SafetyFilter, or its specification", "Make a StorageFilter(...)."
        )
    arguments: dict[str, Any] = dict(value)
    kind_name = arguments.pop("name")
    require_choice(f"{name}['name']", kind_name, tuple(FILTERS))
    kind = FILTERS[kind_name]
    try:
        return kind(**arguments)
    except TypeError as error:
        raise ParameterError(
            name, value, f"the arguments of {kind.__name__}", "See its specification."
        ) from error
