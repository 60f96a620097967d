"""The errors that a storage filter's conditions must provide for, in a given environment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamRanges
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.error_search import ErrorSearch, require_affordable
from defmanip_gym.wrappers.filter_motions import moving_states, resting_states

Array = NDArray[np.float64]

_COUNT, _RESTING = 1024, 128  # motions searched, and those of them that start from rest
_PERIODS = 12  # in which wild commands excite what they can
_MARGIN = 1.1  # on what the search finds


@dataclass(frozen=True, kw_only=True)
class FilterErrors:
    """The largest errors found, with a margin of a tenth; see ``FilterConditions``.

    Attributes:
        acceleration_m_s2: forward, to the side and upwards.
        storage: as a share of V_σ.
    """

    acceleration_m_s2: tuple[float, float, float]
    storage: float


@lru_cache(maxsize=64)
def filter_errors(config: TransportConfig, safety_filter: StorageFilter) -> FilterErrors:
    """Return how far motions stray from what a storage filter foresees.

    Args:
        config: the environment's definition, in task mode.
        safety_filter: for its beams; it acts in the search.

    Raises:
        CertificateError: the search would take too long.
    """
    require_affordable(config)
    accelerations, storage = np.zeros(3), 0.0
    for beam in dict.fromkeys(config.beam_ranges.extremes(config.beam)):
        carried = replace(
            config, beam=beam, nominal_beam=config.believed_beam, beam_ranges=BeamRanges()
        )
        found, stored = _errors(carried, safety_filter)
        accelerations, storage = np.maximum(accelerations, found), max(storage, stored)
    forward, left, up = (_MARGIN * accelerations).tolist()
    return FilterErrors(acceleration_m_s2=(forward, left, up), storage=_MARGIN * storage)


def _errors(config: TransportConfig, safety_filter: StorageFilter) -> tuple[Array, float]:
    rng = np.random.default_rng(0)
    noiseless = safety_filter.with_conditions(swing_noise_rad=0.0)
    carried = noiseless.for_beam(config.beam)
    search = ErrorSearch(
        config,
        noiseless,
        resting_states(config, _RESTING, rng, config.task.start.largest_swing_rad),
        moving_states(config, noiseless, _COUNT - _RESTING, rng),
        rng,
        periods=_PERIODS,
        delay_periods=safety_filter.conditions.delay_periods,
    )
    accelerations, storage = np.zeros(3), 0.0
    for period in search.periods():
        accelerations = np.maximum(accelerations, period.surprise[period.counted].max(axis=0))
        stored = carried.storage_errors(period.before, period.after)
        storage = max(storage, float(stored[period.counted].max()))
    return accelerations, storage
