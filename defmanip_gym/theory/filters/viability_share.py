"""Which share of the viable set a storage filter, or a certificate, lets a hinge make use of.

A share of states. A certificate may let nearly all of storage's be reached, by many small pushes in
resonance; what it keeps is the size of a push.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.phase_plane import one_hinge_reachable_set
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.theory.filters.viability import Bounds, ViableSet

_ANGLES = 2001


class _Keeper(Protocol):
    @property
    def sigma_rad(self) -> float: ...

    def covers(self, beam: BeamParams, /) -> bool: ...


def storage_share(viable: ViableSet, barrier: StorageFilter, *, reserved: bool = True) -> Bounds:
    """Return the share of the viable set's volume in which B is below its level, without turning.

    Args:
        viable: the set.
        barrier: a filter for that object.
        reserved: whether what the filter keeps back for errors is left out; otherwise up to V_σ.

    Raises:
        CertificateError: the filter is for another object or σ.
    """
    _require_same(viable, barrier, "filter")
    model = barrier.setup.model
    levels = barrier.setup.levels if reserved else model.passes
    swing = -viable.sigma_rad * np.cos(np.linspace(0, math.pi, _ANGLES))
    squares = [
        2
        * (
            levels[c]
            - GRAVITY_M_S2 * model.moments[c, 0] * (1 - np.cos(swing))
            - 0.5 * model.stiffness[c, 0, 0] * swing**2
        )
        / (model.coupling[c, 0, 0] + model.inertia[c, 0])
        for c in range(len(levels))
    ]
    rate = np.sqrt(np.maximum(np.min(squares, axis=0), 0.0))
    return _share(viable, 2 * float(np.trapezoid(rate, swing)))


def certificate_share(viable: ViableSet, certificate: Certificate) -> Bounds:
    """Return the share of the viable set's volume that a certificate's bound lets be reached.

    Args:
        viable: the set.
        certificate: of that object.

    Raises:
        CertificateError: the certificate is for another object or σ, or does not hold.
    """
    _require_same(viable, certificate, "certificate")
    edge = one_hinge_reachable_set(
        viable.beam,
        certificate.resulting_acceleration,
        viable.sigma_rad,
        certificate.conditions,
        certificate.intervals,
    )
    if edge is None:
        raise CertificateError(
            "acceleration",
            certificate.resulting_acceleration,
            "one that keeps the beam within sigma_rad",
            "Take a certificate that is proven, such as phase_plane.",
        )
    return _share(viable, 2 * float(np.trapezoid(edge[1], edge[0])))


def _share(viable: ViableSet, area: float) -> Bounds:
    """Return the share that a set of one area at every speed takes."""
    volume = 2 * viable.task.max_speed_m_s * area
    return Bounds(volume / viable.volume.high, volume / viable.volume.low)


def _require_same(viable: ViableSet, keeper: _Keeper, kind: str) -> None:
    if not keeper.covers(viable.beam) or not math.isclose(keeper.sigma_rad, viable.sigma_rad):
        raise CertificateError(
            f"object and sigma_rad of the {kind}",
            (viable.beam, viable.sigma_rad),
            "those of the viable set",
            f"Make viable set and {kind} for the same beam and sigma_rad.",
        )
