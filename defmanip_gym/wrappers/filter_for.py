"""A filter with room for the errors of a robot: the environment's own, not a constant."""

from __future__ import annotations

from typing import TypeVar

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.payloads.mjcf import MjcfPayload
from defmanip_gym.theory.filters.conditions import (
    LARGEST_FACTOR,
    FilterConditions,
    PayloadIntervals,
)
from defmanip_gym.theory.filters.family import REFERENCE_FILTERS, STORAGE_FILTERS
from defmanip_gym.theory.filters.object_filter import ObjectConditions, ObjectStorageFilter
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.validation import require_instance, require_params
from defmanip_gym.wrappers.applicability import require_fit
from defmanip_gym.wrappers.filter_errors import FilterErrors, filter_errors

_Made = TypeVar("_Made", StorageFilter, ObjectStorageFilter)
_KINDS = (*STORAGE_FILTERS.values(), *REFERENCE_FILTERS.values())
_ROUNDS = 4
_SPARE = 1.05  # another level makes other errors
_HOPELESS_M_S2 = 100.0  # the search has left what robots do


def filter_for(
    config: TransportConfig,
    *,
    kind: type[StorageFilter] = StorageFilter,
    beam: BeamParams | None = None,
    intervals: PayloadIntervals | None = None,
    delay_periods: int = 0,
) -> StorageFilter:
    """Return a filter for an environment, with as much room for errors as its robot makes.

    Args:
        config: ``env.unwrapped.config``, in task mode.
        kind: of the family.
        beam: that the filter believes; the environment's own beam by default.
        intervals: around it; by default those that ``config.beam_ranges`` draw from.
        delay_periods: control periods until an action takes effect, as ``ActionDelay`` has them.

    Raises:
        CertificateError: errors, noise and delay leave nothing of V_σ.
    """
    require_instance("config", config, TransportConfig)
    beam = config.beam if beam is None else require_params("beam", beam, BeamParams)
    if kind not in _KINDS:
        names = ", ".join(each.__name__ for each in _KINDS)
        raise ParameterError("kind", kind, f"one of {names}", "Other filters are made directly.")
    conditions = FilterConditions(
        swing_noise_rad=config.largest_disturbance.swing_sensor_noise_rad,
        delay_periods=delay_periods,
    )
    made = kind(
        beam,
        sigma_rad=config.sigma_rad,
        robot=config.robot,
        task=config.task,
        conditions=conditions,
        intervals=_drawn_around(config, beam) if intervals is None else intervals,
    )
    return _with_room(config, made)


def payload_filter_for(
    config: TransportConfig, *, delay_periods: int = 0
) -> StorageFilter | ObjectStorageFilter:
    """Return the filter for whatever an environment carries; of rods as ``filter_for`` does.

    Args:
        config: ``env.unwrapped.config``, in task mode.
        delay_periods: control periods until an action takes effect, as ``ActionDelay`` has them.

    Raises:
        CertificateError: errors, noise and delay leave nothing of V_σ.
        ObjectFileError: the object has springs that links do not.
    """
    require_instance("config", config, TransportConfig)
    if not isinstance(config.payload, MjcfPayload):
        return filter_for(config, delay_periods=delay_periods)
    made = ObjectStorageFilter(
        config.payload.linkage,
        mass_kg=config.payload.mass_kg,
        sigma_rad=config.sigma_rad,
        robot=config.robot,
        task=config.task,
        conditions=ObjectConditions(
            swing_noise_rad=config.largest_disturbance.swing_sensor_noise_rad,
            delay_periods=delay_periods,
        ),
    )
    return _with_room(config, made)


def _with_room(config: TransportConfig, made: _Made) -> _Made:
    """Return the filter with room for the errors that its environment makes."""
    require_fit(config, made)
    for _ in range(_ROUNDS):
        found, given = filter_errors(config, made), made.conditions
        if max(found.acceleration_m_s2) > _HOPELESS_M_S2 or _SPARE * found.storage >= 1.0:
            break
        needed = _provided(found, given)
        if all(size <= getattr(given, name) for name, size in needed.items()):
            return made
        room = {name: max(getattr(given, name), _SPARE * size) for name, size in needed.items()}
        made = made.with_conditions(**room)
    raise CertificateError(
        "errors of the environment",
        found,
        "errors that do not grow with the room that is made for them",
        "Use a shorter control period or delay, a smaller max_acceleration_m_s2 or a better "
        "nominal beam.",
    )


def _provided(found: FilterErrors, conditions: FilterConditions) -> dict[str, float]:
    """Return the fields of conditions that errors need."""
    forward, lateral, vertical = found.acceleration_m_s2
    felt = isinstance(conditions, ObjectConditions)  # rods do not mind what pushes them aside
    aside = {"lateral_offset_m_s2": found.offset_m_s2[1]} if felt else {}
    return aside | {
        "forward_error_m_s2": forward,
        "lateral_error_m_s2": lateral,
        "vertical_error_m_s2": vertical,
        "forward_offset_m_s2": found.offset_m_s2[0],
        "vertical_offset_m_s2": found.offset_m_s2[2],
        "storage_error": found.storage,
    }


def _drawn_around(config: TransportConfig, beam: BeamParams) -> PayloadIntervals:
    """Return the factors on ``beam`` of what the environment draws and carries."""
    carried = config.beam_ranges.extremes(config.beam)

    def factors(name: str) -> tuple[float, float]:
        shares = [getattr(each, name) / getattr(beam, name) for each in (beam, *carried)]
        return min(shares), max(shares)

    return PayloadIntervals(
        mass=factors("mass_kg"),
        length=factors("length_m"),
        damping=_damping_around(beam, carried),
    )


def _damping_around(beam: BeamParams, carried: tuple[BeamParams, ...]) -> tuple[float, float]:
    """Return the factors on the damping, as far as intervals go: most filters need none."""
    if not beam.damping > 0:
        return 1.0, 1.0
    shares = [each.damping / beam.damping for each in (beam, *carried)]
    return min(shares), min(max(shares), LARGEST_FACTOR)
