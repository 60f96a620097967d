"""What the errors of a robot need of a certificate's room."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.error_budget import ErrorBudget
from defmanip_gym.theory.filters.nu_max_filter import NuMaxFilter
from defmanip_gym.wrappers.admissible_motions import moving_motions, resting_motions
from defmanip_gym.wrappers.error_search import ErrorSearch, require_affordable, worst_cases

Array = NDArray[np.float64]

_COUNT, _RESTING = 1024, 128  # motions searched, and those of them that start from rest
_PERIODS = 3
_MARGIN = 1.1  # on what the search finds


@dataclass(frozen=True, kw_only=True)
class RealizationErrors:
    """The largest errors found, with a margin of a tenth.

    Attributes:
        room_m_s2: forward acceleration that they need of a certificate's room; see ``ErrorBudget``.
        stray_m_s: mean distance of the grasp's velocity from the straight line between samples.
        yaw_rate_rad_s: largest |u2|, without a margin.
    """

    room_m_s2: float
    stray_m_s: float
    yaw_rate_rad_s: float


@lru_cache(maxsize=64)
def realization_errors(config: TransportConfig, certificate: Certificate) -> RealizationErrors:
    """Return how far the acceleration strays from what ``NuMaxActionScaling`` counts on.

    Args:
        config: the environment's definition, in task mode.
        certificate: for its beam; bounds and conditions are enforced in the search.

    Raises:
        CertificateError: the search would take too long.
    """
    require_affordable(config)
    each = [_errors(carried, certificate) for carried in worst_cases(config)]
    return RealizationErrors(
        room_m_s2=max(errors.room_m_s2 for errors in each),
        stray_m_s=max(errors.stray_m_s for errors in each),
        yaw_rate_rad_s=max(errors.yaw_rate_rad_s for errors in each),
    )


def _errors(config: TransportConfig, certificate: Certificate) -> RealizationErrors:
    rng = np.random.default_rng(0)
    budget = ErrorBudget.of(
        certificate, [config.beam], physics_period_s=config.task.physics_period_s
    )
    search = ErrorSearch(
        config,
        NuMaxFilter(certificate, robot=config.robot, task=config.task),
        resting_motions(config, certificate, _RESTING, rng),
        moving_motions(config, certificate, _COUNT - _RESTING, rng),
        rng,
        periods=_PERIODS,
    )
    room = stray = yaw_rate = 0.0
    for period in search.periods():
        needed = budget.needed(period.surprise[:, 0], period.surprise[:, 2], period.stray)
        room = max(room, float(needed[period.counted].max()))
        stray = max(stray, float(period.stray.max()))
        yaw_rate = max(yaw_rate, float(np.abs(period.yaw_rate).max()))
    return RealizationErrors(
        room_m_s2=_MARGIN * room, stray_m_s=_MARGIN * stray, yaw_rate_rad_s=yaw_rate
    )
