"""Safety filters as data: what a job carries, and a filter for each condition where it runs.

A certificate is one for all conditions. A storage filter knows what may differ: the intervals of a
suite's beams, the noise and the delay, and has room for the errors of such robots.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

from defmanip_gym.envs.config import InnerLoopKind, TransportConfig
from defmanip_gym.envs.registration import ROBUST_FACTORS
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.params import DESIGN_DAMPING, BeamRanges
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, Certificate, certify
from defmanip_gym.theory.filters.family import REFERENCE_FILTERS, STORAGE_FILTERS
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.nu_max_scaling import nu_max_filter

# factors on the nominal beam that are provided for where a condition carries another
MISMATCH_FACTORS = {"damping": (0.1, 10.0), "mass_kg": (0.8, 1.2), "length_m": (0.8, 1.2)}
# and where the inner loop takes no weight for granted; on the other one errors would leave nothing
MEASURED_FACTORS = ROBUST_FACTORS


class Protection(Protocol):
    """What keeps a contestant within σ; can be pickled and hashed."""

    def __hash__(self) -> int: ...

    @property
    def method(self) -> str:
        """By which it is named."""
        ...

    @property
    def certificate(self) -> Certificate | None:
        """Whose bounds it enforces; None for filters that know the state."""
        ...

    @property
    def identity(self) -> dict[str, Any]:
        """What it enforces and for what, as JSON values."""
        ...

    def filter_for(self, condition: Condition) -> SafetyFilter:
        """Return the filter for the environments of a condition."""
        ...

    def filter_in(self, config: TransportConfig) -> SafetyFilter:
        """Return the filter for an environment, and all beams that it draws."""
        ...


@dataclass(frozen=True)
class CertificateProtection:
    """A certificate's bounds: ν_max, whatever the object does."""

    certificate: Certificate

    @property
    def method(self) -> str:
        """By which it is named."""
        return self.certificate.method

    @property
    def identity(self) -> dict[str, Any]:
        """What it enforces and for what, as JSON values."""
        return asdict(self.certificate)

    def filter_for(self, condition: Condition) -> SafetyFilter:
        """Return the filter for the environments of a condition."""
        return self.filter_in(condition.environment)

    def filter_in(self, config: TransportConfig) -> SafetyFilter:
        """Return the filter for an environment."""
        return nu_max_filter(config, self.certificate)


@dataclass(frozen=True)
class StorageProtection:
    """A filter of the storage's kind, for the nominal beam.

    Attributes:
        method: by which it is named.
        inner_loop: of the environment, whose errors it has room for.
    """

    method: str
    inner_loop: InnerLoopKind = "model"
    certificate: None = None

    @property
    def factors(self) -> dict[str, tuple[float, float]]:
        """What it provides for where a condition carries another beam than the nominal one."""
        return MISMATCH_FACTORS if self.inner_loop == "model" else MEASURED_FACTORS

    @property
    def identity(self) -> dict[str, Any]:
        """What it enforces and for what, as JSON values."""
        return {
            "filter": self.method,
            "beam": asdict(NOMINAL_BEAM),
            "mismatch": self.factors,
            "inner_loop": self.inner_loop,
        }

    def filter_for(self, condition: Condition) -> SafetyFilter:
        """Return the filter for the environments of a condition."""
        return _storage_filter(self, condition)

    def filter_in(self, config: TransportConfig, delay_periods: int = 0) -> SafetyFilter:
        """Return the filter for an environment, and all beams that it draws."""
        return filter_for(
            config,
            kind=(STORAGE_FILTERS | REFERENCE_FILTERS)[self.method],
            beam=NOMINAL_BEAM,
            delay_periods=delay_periods,
        )


@lru_cache(maxsize=64)
def _storage_filter(protection: StorageProtection, condition: Condition) -> SafetyFilter:
    """Return a filter that knows a condition's noise and delay, and of its beam the intervals."""
    config = condition.environment_on(protection.inner_loop)
    if condition.beam != NOMINAL_BEAM:
        ranges = {
            name: tuple(factor * getattr(NOMINAL_BEAM, name) for factor in ends)
            for name, ends in protection.factors.items()
        }
        payload = replace(config.rod, beam=NOMINAL_BEAM, beam_ranges=BeamRanges(**ranges))
        config = replace(config, payload=payload)
    return protection.filter_in(config, condition.delay_periods)


class Certificates:
    """Certificates for the nominal beam under ``TRANSPORT_CONDITIONS``, made when asked for."""

    def __init__(self) -> None:
        self._made: dict[str, Certificate] = {}

    def named(self, method: str) -> Certificate:
        """Return the certificate of a method; the paper's is for its own design damping."""
        if method not in self._made:
            beam = NOMINAL_BEAM
            if method == "tanner":
                beam = replace(beam, damping=DESIGN_DAMPING)
            self._made[method] = certify(beam, method=method, conditions=TRANSPORT_CONDITIONS)
        return self._made[method]


def protection_named(
    method: str, certificates: Certificates, inner_loop: InnerLoopKind = "model"
) -> Protection | None:
    """Return a filter by its name, None for an empty one."""
    if not method:
        return None
    if method in STORAGE_FILTERS | REFERENCE_FILTERS:
        return StorageProtection(method, inner_loop)
    return CertificateProtection(certificates.named(method))
