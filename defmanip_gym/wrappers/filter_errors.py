"""The errors that a storage filter's conditions must provide for, in a given environment."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.workspace import in_workspace, workspace_of
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping
from defmanip_gym.wrappers.error_search import ErrorSearch, require_affordable, worst_cases
from defmanip_gym.wrappers.filter_motions import moving_states, resting_states

Array = NDArray[np.float64]

_COUNT, _RESTING = 1024, 128  # motions searched, and those of them that start from rest
_PERIODS = 12  # in which wild commands excite what they can
_FOUND = 7  # numbers: three changes, three offsets, the storage
_MARGIN = 1.1  # on what the search finds


@dataclass(frozen=True, kw_only=True)
class FilterErrors:
    """The largest errors found, with a margin of a tenth; see ``FilterConditions``.

    Attributes:
        acceleration_m_s2: changes of the offset, forward, to the side and upwards.
        offset_m_s2: the offset itself.
        storage: as a share of V_σ.
    """

    acceleration_m_s2: tuple[float, ...]
    offset_m_s2: tuple[float, ...]
    storage: float


@lru_cache(maxsize=64)
def filter_errors(config: TransportConfig, safety_filter: StorageKeeping) -> FilterErrors:
    """Return how far motions stray from what a storage filter foresees.

    Args:
        config: the environment's definition, in task mode.
        safety_filter: for what is carried; it acts in the search.

    Raises:
        CertificateError: the search would take too long.
    """
    require_affordable(config)
    errors = np.zeros(_FOUND)
    for carried in worst_cases(config):
        errors = np.maximum(errors, _errors(carried, safety_filter))
    found = (_MARGIN * errors).tolist()
    return FilterErrors(
        acceleration_m_s2=tuple(found[:3]), offset_m_s2=tuple(found[3:6]), storage=found[6]
    )


def _errors(config: TransportConfig, safety_filter: StorageKeeping) -> Array:
    """Return changes of the offset, offsets and errors of the storage, (7,), as found."""
    rng = np.random.default_rng(0)
    noiseless = safety_filter.with_conditions(swing_noise_rad=0.0)
    carried = noiseless.for_carried(config.payload.carried[0])
    search = ErrorSearch(
        config,
        noiseless,
        resting_states(config, _RESTING, rng, config.task.start.largest_swing_rad),
        moving_states(config, noiseless, _COUNT - _RESTING, rng),
        rng,
        periods=_PERIODS,
        delay_periods=safety_filter.conditions.delay_periods,
    )
    layout, space = ObservationLayout(config.payload.count), workspace_of(config)
    errors, running = np.zeros(_FOUND), np.ones(_COUNT, dtype=bool)
    for period in search.periods():
        pitch = layout.part(period.after, "joints").cumsum(axis=1)
        # where the arm has left its workspace the episode is over
        running &= in_workspace(space.center_x_m, space.center_y_m, pitch[:, 0], pitch[:, 1], space)
        counted = period.counted & running
        if not counted.any():
            break
        stored = carried.storage_errors(period.before, period.after)
        offsets = np.abs(period.memory.residual)
        found = np.concatenate((period.surprise, offsets, stored[:, None]), axis=1)
        errors = np.maximum(errors, found[counted].max(axis=0))
    return errors
