"""Attacks on certificates: everything that one takes for granted, at its worst."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from defmanip_gym.attack.result import AttackResult
from defmanip_gym.attack.search import attack
from defmanip_gym.attack.target import LEFT, InputLimits, PlantFactors, Target, beam_target
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import Certificate

_MOST_LOWERINGS = 5


def attack_certificate(
    certificate: Certificate,
    *,
    target: Target | None = None,
    plant_parameters: Sequence[PlantFactors] | None = None,
    longest_s: float = 60.0,
    iterations: int = 4,
    num_threads: int = 0,
) -> AttackResult:
    """Search for the worst input that a certificate admits.

    Args:
        certificate: the certificate under attack.
        target: its object on the rig; by default built for a beam's certificate.
        plant_parameters: plants within the certificate's intervals; by default the one on which
            its bound is smallest and the corners of the intervals.
        longest_s: longest attack.
        iterations: steps of adjoint ascent at each level.
        num_threads: of the plant, 0 for one per CPU.
    """
    if target is None:
        if not isinstance(certificate.deformable, BeamParams):
            raise ParameterError(
                "target",
                target,
                "a Target where the certificate is not for a beam",
                "Pass target=mjcf_target(...) of the certified object.",
            )
        target = beam_target(certificate.deformable)
    return attack(
        target,
        admissible(certificate, target),
        sigma=certificate.sigma_rad,
        acceleration_error=certificate.conditions.acceleration_error_m_s2,
        plants=plants_within(certificate) if plant_parameters is None else plant_parameters,
        longest_s=longest_s,
        iterations=iterations,
        num_threads=num_threads,
    )


def withstanding(
    certificate: Certificate, broken: AttackResult, *, target: Target, longest_s: float = 60.0
) -> Certificate | None:
    """Return a broken certificate, lowered until an attack of its own does not break it any more.

    Args:
        certificate: the certificate that was broken.
        broken: by what.
        target: its object on the rig.
        longest_s: longest attack.

    Returns:
        The lowered certificate; None where attacks broke every one that was tried.
    """
    result = broken
    for _ in range(_MOST_LOWERINGS):
        if result.withstood_bound <= 0:
            break
        certificate = certificate.lowered(result.withstood_bound)
        result = attack_certificate(certificate, target=target, longest_s=longest_s)
        if not result.is_broken:
            return certificate
    return None


def admissible(certificate: Certificate, target: Target) -> InputLimits:
    """Return the inputs and starts that a certificate covers."""
    conditions = certificate.conditions
    resulting = certificate.resulting_acceleration
    return InputLimits(
        forward_m_s2=resulting,
        # certified for each horizontal axis where both deform the object
        left_m_s2=resulting if target.linear.m_o12[LEFT].any() else 0.0,
        up_m_s2=conditions.vertical_acceleration_m_s2,
        yaw_rate_rad_s=conditions.yaw_rate_rad_s,
        start=conditions.initial_swing_rad,
        start_rate=conditions.initial_swing_rate_rad_s,
    )


def plants_within(certificate: Certificate) -> tuple[PlantFactors, ...]:
    """Return the worst factors and the corners of a certificate's intervals, each once."""
    intervals = certificate.intervals
    corners = itertools.product(intervals.damping, intervals.stiffness)
    factors = dict.fromkeys((certificate.worst_factors, *corners))
    return tuple(
        PlantFactors(damping=damping, stiffness=stiffness) for damping, stiffness in factors
    )
