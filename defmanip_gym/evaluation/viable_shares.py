"""Which share of what is possible at all a filter lets the nominal beam make use of."""

from __future__ import annotations

from functools import lru_cache

from defmanip_gym.errors import CertificateError
from defmanip_gym.evaluation.conditions import NOMINAL
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.theory.filters.viability import ViableSet, viable_set
from defmanip_gym.theory.filters.viability_share import certificate_share, storage_share


def viable_share(protection: Protection) -> float | None:
    """Return the share of the viable set that a filter keeps to, at least; None if not known.

    That of filters which roll the beam out depends on more than swing and speed.
    """
    try:
        if protection.certificate is not None:
            return certificate_share(_nominal(), protection.certificate).low
        made = protection.filter_for(NOMINAL)
        return storage_share(_nominal(), made).low if type(made) is StorageFilter else None
    except CertificateError:  # a certificate for another beam than the nominal one
        return None


@lru_cache(maxsize=1)
def _nominal() -> ViableSet:
    config = NOMINAL.environment
    return viable_set(config.beam, sigma_rad=config.sigma_rad, task=config.task)
