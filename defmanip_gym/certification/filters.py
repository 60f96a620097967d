"""What filters that measure the swing make of an object: V_σ, where its pass is, what is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.errors import CertificateError, ObjectFileError, ParameterError
from defmanip_gym.objects.mjcf_object import MjcfObject
from defmanip_gym.theory.certificates.conditions import CertificateConditions
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.conditions import PayloadIntervals
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.theory.filters.object_filter import ObjectStorageFilter
from defmanip_gym.theory.filters.safety_filter import FilterProof
from defmanip_gym.theory.filters.storage import lowest_pass
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping

# stored energy over the level, of z2, ż2 and the yaw rate
Share = Callable[[Array, Array, float], float]


@dataclass(frozen=True, kw_only=True)
class FilterLine:
    """A filter for an object.

    Attributes:
        name: of the filter.
        pass_j: V_σ, the lowest energy at which a coordinate is at σ, J; None if there is none.
        coordinate: name of the one that is there.
        level_share: up to which share of V_σ the storage may rise; None without a filter.
        proof: for which model of the object it is proven.
        largest_m_s2: acceleration that it may allow on each axis.
        edge: upper edge (φ, φ̇) of the set that is kept; beams of one hinge only.
        admits: whether the starts that were asked for are within that set.
        refusal: why there is no filter; empty if there is.
    """

    name: str
    pass_j: float | None
    coordinate: str
    level_share: float | None
    proof: FilterProof
    largest_m_s2: float
    edge: tuple[Array, Array] | None
    admits: bool
    refusal: str

    @property
    def amplitude_rad(self) -> float | None:
        """Largest swing at rest that is kept; beams of one hinge only."""
        return None if self.edge is None else float(self.edge[0].max())


def beam_lines(
    config: CertifyConfig, conditions: CertificateConditions, coordinates: tuple[str, ...]
) -> tuple[FilterLine, ...]:
    """Return a line for each filter of the storage's kind, for the configuration's beam.

    Raises:
        CertificateError: a beam without any potential energy.
    """
    pass_j, segment = lowest_pass(config.beam, config.sigma)
    lines = []
    for name, kind in STORAGE_FILTERS.items():
        made, refusal = None, ""
        try:
            intervals = PayloadIntervals(stiffness=config.stiffness_interval)
            made = kind(config.beam, sigma_rad=config.sigma, intervals=intervals)
        except (CertificateError, ParameterError) as error:
            refusal = str(error)
        lines.append(
            FilterLine(
                name=name,
                pass_j=pass_j,
                coordinate=coordinates[segment],
                level_share=None if made is None else made.level_share,
                proof="none" if made is None else made.proof,
                largest_m_s2=0.0 if made is None else made.task.max_acceleration_m_s2,
                edge=None if made is None else made.edge(),
                admits=made is not None
                and _admits(_share_of(made), conditions, np.zeros(len(coordinates))),
                refusal=refusal,
            )
        )
    return tuple(lines)


def file_lines(
    config: CertifyConfig, conditions: CertificateConditions, thing: MjcfObject
) -> tuple[FilterLine, ...]:
    """Return the line of the storage filter for an object from a file."""
    try:
        made = ObjectStorageFilter(
            thing.linkage(), mass_kg=thing.object_file.mass_kg, sigma_rad=config.sigma
        )
    except (CertificateError, ObjectFileError) as error:
        return (_refused(ObjectStorageFilter.name, str(error)),)

    return (
        FilterLine(
            name=made.name,
            pass_j=made.pass_j,
            coordinate=thing.linear.coordinates[made.coordinate],
            level_share=made.level_share,
            proof=made.proof,
            largest_m_s2=made.task.max_acceleration_m_s2,
            edge=None,
            admits=_admits(_share_of(made), conditions, made.equilibrium),
            refusal="",
        ),
    )


def _refused(name: str, refusal: str) -> FilterLine:
    return FilterLine(
        name=name,
        pass_j=None,
        coordinate="",
        level_share=None,
        proof="none",
        largest_m_s2=0.0,
        edge=None,
        admits=False,
        refusal=refusal,
    )


def _share_of(made: StorageKeeping) -> Share:
    def share(z2: Array, rate: Array, yaw_rate: float) -> float:
        return float(made.shares_of(z2[None], rate[None], np.array([yaw_rate]))[0])

    return share


def _admits(share: Share, conditions: CertificateConditions, rest: Array) -> bool:
    """Whether starts about rest, all coordinates to one side or in turn, are below the level."""
    signs = np.ones((2, len(rest)))
    signs[1, 1::2] = -1.0  # bends springs most
    return all(
        share(
            rest + conditions.initial_swing_rad * side,
            conditions.initial_swing_rate_rad_s * side,
            conditions.yaw_rate_rad_s,
        )
        <= 1.0
        for side in (*signs, *-signs)
    )
