"""ν_max as an action-scaling wrapper: no policy inside it can violate the certificate."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.filters.nu_max_filter import NuMaxFilter
from defmanip_gym.validation import plain
from defmanip_gym.wrappers.filtering import Filtered
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper, SafetyFilterWrapper
from defmanip_gym.wrappers.transport import transport_config

Array = NDArray[np.float64]


def nu_max_filter(config: TransportConfig, certificate: Certificate) -> NuMaxFilter:
    """Return the filter that keeps an environment within a certificate.

    Args:
        config: ``env.unwrapped.config``.
        certificate: the bounds to enforce, or a mapping of its fields.
    """
    return NuMaxFilter(certificate, robot=config.robot, task=config.task)


class NuMaxActionScaling(SafetyFilterWrapper):
    """Keeps every action of a single environment within a certificate: the ``nu_max`` filter.

    ``info`` has what :class:`SafetyFilterWrapper` tells, and under their earlier names
    ``intervention_m_s2``, ``certificate_applies`` and ``certificate_reason``.

    Args:
        env: a DeformTransport environment in task mode.
        certificate: the bounds to enforce; or a mapping of its fields, as the JSON of a
            specification holds it.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    def __init__(self, env: gymnasium.Env[Array, Array], certificate: Certificate) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self, certificate=plain(certificate))
        super().__init__(env, nu_max_filter(transport_config(env), certificate))

    def _report(self, filtered: Filtered) -> dict[str, Any]:
        return _with_earlier_names(super()._report(filtered))


class NuMaxVectorActionScaling(SafetyFilterVectorWrapper):
    """The same for a batch; every added info key holds an array over the episodes.

    Args:
        env: a batched DeformTransport environment in task mode.
        certificate: the bounds to enforce; or a mapping of its fields, as the JSON of a
            specification holds it.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    def __init__(
        self, env: gymnasium.vector.VectorEnv[Any, Any, Any], certificate: Certificate
    ) -> None:
        super().__init__(env, nu_max_filter(transport_config(env), certificate))

    def _report(self, filtered: Filtered) -> dict[str, Any]:
        return _with_earlier_names(super()._report(filtered))


def _with_earlier_names(told: dict[str, Any]) -> dict[str, Any]:
    return told | {
        "intervention_m_s2": told["correction_m_s2"],
        "certificate_applies": told["filter_applies"],
        "certificate_reason": told["filter_reason"],
    }
