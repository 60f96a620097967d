"""What the filters that know the state make of an object: V_σ, where its pass is, what is kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.theory.certificates.conditions import CertificateConditions
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.theory.filters.storage import lowest_pass
from defmanip_gym.theory.filters.storage_filter import StorageFilter


@dataclass(frozen=True, kw_only=True)
class FilterLine:
    """A filter for a beam.

    Attributes:
        name: of the filter.
        pass_j: V_σ, the lowest energy at which a segment is at σ, J.
        segment: the segment that is there, counted from the grasp, 0 first.
        made: the filter with room for the default robot's errors; None if there is none.
        refusal: why there is none; empty if there is.
    """

    name: str
    pass_j: float
    segment: int
    made: StorageFilter | None
    refusal: str

    @property
    def level_share(self) -> float | None:
        """Up to which share of V_σ the storage may rise."""
        return None if self.made is None else self.made.level_share

    @property
    def edge(self) -> tuple[Array, Array] | None:
        """Upper edge (φ, φ̇) of the set that is kept; one hinge only."""
        return None if self.made is None else self.made.edge()

    @property
    def amplitude_share(self) -> float | None:
        """Largest swing at rest that is kept, as a share of σ; one hinge only."""
        if self.made is None or self.edge is None:
            return None
        return float(self.edge[0].max()) / self.made.sigma_rad

    def admits(self, conditions: CertificateConditions) -> bool:
        """Whether starts that the conditions allow are within what is kept."""
        if self.made is None:
            return False
        signs = np.ones((2, self.made.segment_count))
        signs[1, 1::2] = -1.0  # all to one side, or to both in turn, which bends springs most
        swing = conditions.initial_swing_rad * signs
        rate = conditions.initial_swing_rate_rad_s * signs
        yaw = np.full(2, conditions.yaw_rate_rad_s)
        return bool((self.made.shares_of(swing, rate, yaw) <= 1.0).all())


def filter_lines(config: CertifyConfig) -> tuple[FilterLine, ...]:
    """Return a line for each filter of the storage's kind; none for an object from a file.

    Raises:
        CertificateError: a beam without any potential energy.
    """
    if config.mjcf is not None:
        return ()
    pass_j, segment = lowest_pass(config.beam, config.sigma)
    lines = []
    for name, kind in STORAGE_FILTERS.items():
        made, refusal = None, ""
        try:
            made = kind(
                config.beam,
                sigma_rad=config.sigma,
                conditions=FilterConditions(),
                intervals=PayloadIntervals(stiffness=config.stiffness_interval),
            )
        except (CertificateError, ParameterError) as error:
            refusal = str(error)
        lines.append(
            FilterLine(name=name, pass_j=pass_j, segment=segment, made=made, refusal=refusal)
        )
    return tuple(lines)
