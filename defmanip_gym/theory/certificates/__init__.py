"""ν_max: bounds on the grasp's motion under which the object stays within σ (Section III)."""

from __future__ import annotations

from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.conditions import (
    EXACT_PARAMETERS,
    TRANSPORT_CONDITIONS,
    CertificateConditions,
    ParameterIntervals,
)
from defmanip_gym.theory.certificates.ladder import certify
from defmanip_gym.theory.certificates.limits import CERTIFICATE_METHODS, PHASE_PLANE

__all__ = [
    "CERTIFICATE_METHODS",
    "EXACT_PARAMETERS",
    "PHASE_PLANE",
    "TRANSPORT_CONDITIONS",
    "Certificate",
    "CertificateConditions",
    "ParameterIntervals",
    "certify",
]
