"""A certificate with room for the errors of a robot: the environment's own, not a constant."""

from __future__ import annotations

from dataclasses import replace

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError
from defmanip_gym.theory.certificates import (
    TRANSPORT_CONDITIONS,
    Certificate,
    CertificateConditions,
    ParameterIntervals,
    certify,
)
from defmanip_gym.validation import require_instance, require_params
from defmanip_gym.wrappers.realization import realization_errors

_ROUNDS = 4
_SPARE = 1.05  # more room makes a smaller bound, and other errors with it


def certificate_for(
    config: TransportConfig,
    *,
    method: str = "phase_plane",
    conditions: CertificateConditions = TRANSPORT_CONDITIONS,
) -> Certificate:
    """Certify the beam of an environment, with as much room for errors as its robot makes.

    The bound is what is proven for the nonlinear beam, since no other applies.

    Args:
        config: ``env.unwrapped.config``, in task mode.
        method: one of ``CERTIFICATE_METHODS``.
        conditions: of the motion; their room for errors is the least that is given.

    Raises:
        CertificateError: errors and conditions alone use up σ, or nothing is proven for this beam.
    """
    require_instance("config", config, TransportConfig)
    conditions = require_params("conditions", conditions, CertificateConditions)
    beams = config.beam_ranges.extremes(config.beam)
    weakest = min(beams, key=lambda beam: beam.damping)
    ends = [beam.damping / weakest.damping if weakest.damping else 1.0 for beam in beams]
    intervals = ParameterIntervals(damping=(min(ends), max(ends)))
    for _ in range(_ROUNDS):
        certificate = certify(
            weakest,
            sigma_rad=config.sigma_rad,
            method=method,
            conditions=conditions,
            intervals=intervals,
        ).proven()
        needed = realization_errors(config, certificate).room_m_s2
        if needed <= conditions.acceleration_error_m_s2:
            return certificate
        conditions = replace(conditions, acceleration_error_m_s2=_SPARE * needed)
    raise CertificateError(
        "acceleration_error_m_s2",
        needed,
        "errors that the certificate's own bound leaves room for",
        "Use a shorter control period, a smaller max_acceleration_m_s2 or a better nominal beam.",
    )
