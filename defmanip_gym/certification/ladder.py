"""All rungs of the ladder for one object, and what attacking the tightest says about them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from defmanip_gym.attack.certificate import attack_certificate, withstanding
from defmanip_gym.attack.result import AttackResult
from defmanip_gym.attack.target import Target, beam_target, mjcf_target
from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.certification.filters import FilterLine, beam_lines, file_lines
from defmanip_gym.errors import CertificateError
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import (
    CERTIFICATE_METHODS,
    PHASE_PLANE,
    TRANSPORT_CONDITIONS,
    Certificate,
    certify,
)
from defmanip_gym.theory.certificates.conditions import CertificateConditions
from defmanip_gym.theory.certificates.peak_bounds import resonant_limit
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """The certificates of one object.

    Attributes:
        linear: the object linearized.
        sigma: σ, rad or m.
        conditions: what was asked of the motion.
        certificates: by method; those that exist, none of them proven for an undamped object.
        refusals: by method, why there is none.
        filters: that measure the swing.
        resonant_limit: amplitude of the forward sinusoid that uses up σ of the linear object, m/s².
        attack: on the tightest certificate, if asked for.
        withstanding: that certificate, lowered until attacks did not break it any more; None where
            it was not broken or is broken however low.
        target: the object on its rig, as attacked.
        beam: the object; None if it is from a file.
    """

    linear: LinearizedObject
    sigma: float
    conditions: CertificateConditions
    certificates: dict[str, Certificate]
    refusals: dict[str, str]
    filters: tuple[FilterLine, ...]
    resonant_limit: float
    attack: AttackResult | None
    withstanding: Certificate | None
    target: Target
    beam: BeamParams | None

    @property
    def tightest(self) -> Certificate | None:
        """The certificate with the largest bound that is one; None of an undamped object."""
        proven = [c for c in self.certificates.values() if c.is_proven]
        return max(proven, key=lambda c: c.acceleration_bound, default=None)

    def is_broken(self, certificate: Certificate) -> bool:
        """Whether the attack's input is within this certificate and exceeds σ."""
        if self.attack is None or not certificate.is_proven:
            return False
        if certificate is self.tightest:
            return self.attack.is_broken
        return self.attack.violating_bound <= certificate.acceleration_bound

    def tightness(self, certificate: Certificate) -> float | None:
        """Return its bound over the smallest violating one; ``None`` without an attack."""
        if self.attack is None or not certificate.is_proven:
            return None
        return certificate.acceleration_bound / self.attack.violating_bound


def compute_ladder(config: CertifyConfig, tell: Callable[[str], None]) -> Ladder:
    """Return the ladder for a configuration.

    Args:
        config: object, conditions and what else was asked for.
        tell: is told what is going on.

    Raises:
        CertificateError: no method gives a certificate, and no filter does without.
        ObjectFileError: the model file cannot be used.
    """
    deformable: BeamParams | LinearizedObject
    thing = None
    if config.mjcf is not None:
        tell(f"reading {config.mjcf}")
        thing = mjcf_object(config.mjcf, grasp_site=config.grasp_site)
        deformable, target = thing.linear, mjcf_target(thing)
    else:
        deformable = config.beam
        target = beam_target(deformable)
    conditions = TRANSPORT_CONDITIONS if config.transport else config.conditions
    certificates: dict[str, Certificate] = {}
    refusals: dict[str, CertificateError] = {}
    for method in CERTIFICATE_METHODS:
        if method == PHASE_PLANE and target.linear.count > 1:
            continue
        tell(f"bound {method}")
        try:
            certificates[method] = certify(
                deformable,
                sigma_rad=config.sigma,
                method=method,
                conditions=conditions,
                intervals=config.intervals,
            )
        except CertificateError as error:
            refusals[method] = error
    tell("filters")
    if thing is not None:
        filters = file_lines(config, conditions, thing)
    else:
        filters = beam_lines(config, conditions, target.linear.coordinates)
    is_certified = any(certificate.is_proven for certificate in certificates.values())
    if not is_certified:
        refusal = refusals["l1"]  # the method that leaves most room to every object
        # only filters do without damping, and what else was asked for they cannot mend
        if refusal.name != "damping" or not any(line.admits for line in filters):
            raise refusal
    tell("nonlinear limit")
    ladder = Ladder(
        linear=target.linear,
        sigma=config.sigma,
        conditions=conditions,
        certificates=certificates,
        refusals={method: str(error) for method, error in refusals.items()},
        filters=filters,
        resonant_limit=_resonant_limit(target.linear, config.sigma) if is_certified else 0.0,
        attack=None,
        withstanding=None,
        target=target,
        beam=deformable if isinstance(deformable, BeamParams) else None,
    )
    tightest, longest_s = ladder.tightest, config.longest_attack_s
    if not config.attack or tightest is None:
        return ladder
    tell("attack on the plant")
    attack = attack_certificate(tightest, target=target, longest_s=longest_s)
    lowered = None
    if attack.is_broken:
        tell("attack on smaller bounds")
        lowered = withstanding(tightest, attack, target=target, longest_s=longest_s)
    return replace(ladder, attack=attack, withstanding=lowered)


def _resonant_limit(linear: LinearizedObject, sigma: float) -> float:
    room = sigma - float(np.abs(linear.equilibrium).max())
    return resonant_limit(linear, room) if linear.forward_input.any() else math.inf
