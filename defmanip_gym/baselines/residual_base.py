"""What a residual corrects, and inside what both of them stay."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import gymnasium

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.registry import inner_loop_of, registered_controllers
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.certificates import (
    CERTIFICATE_METHODS,
    TRANSPORT_CONDITIONS,
    Certificate,
    certify,
)
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.validation import require_choice, require_positive
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling, NuMaxVectorActionScaling
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper, SafetyFilterWrapper
from defmanip_gym.wrappers.transport import known_delay_periods, transport_config

PAPERS = "tanner"


@dataclass(frozen=True, kw_only=True)
class ResidualBase:
    """What is below a residual.

    Attributes:
        controller: that is corrected.
        protection: what corrected commands stay inside.
        authority: largest correction of a normalized action, in (0, 1].
    """

    controller: Controller
    protection: Certificate | StorageFilter
    authority: float

    def around(self, env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
        """Return a single environment inside the protection."""
        if isinstance(self.protection, Certificate):
            return NuMaxActionScaling(env, self.protection)
        return SafetyFilterWrapper(env, self.protection)

    def around_batch(
        self, env: gymnasium.vector.VectorEnv[Any, Any, Any]
    ) -> gymnasium.vector.VectorEnv[Any, Any, Any]:
        """Return a batch inside the protection."""
        if isinstance(self.protection, Certificate):
            return NuMaxVectorActionScaling(env, self.protection)
        return SafetyFilterVectorWrapper(env, self.protection)


def residual_base(env: Any, *, base: str, inside: str, authority: float) -> ResidualBase:
    """Return what a residual corrects in an environment.

    Args:
        env: a DeformTransport environment in task mode, single or batched.
        base: name of a registered controller. Inside a certificate it is the paper's, with the
            gains that were chosen by hand, and keeps to the certificate's bounds itself.
        inside: a certificate's method, or a safety filter's name.
        authority: largest correction of each axis: inside a certificate in units of the certified
            acceleration, inside a filter of the largest one.

    Raises:
        CertificateError: there is no such certificate or filter for this environment.
        ParameterError: an unknown name, a base that does not go with the rest, or an authority
            out of range.
    """
    config = transport_config(env)
    require_choice("inside", inside, (*CERTIFICATE_METHODS, *STORAGE_FILTERS))
    if inside in STORAGE_FILTERS:
        return ResidualBase(
            controller=corrected_controller(base, config),
            protection=shared_filter(config, inside, known_delay_periods(env)),
            authority=filter_authority(authority),
        )
    require_choice(f"base inside {inside}", base, (PAPERS,))
    certificate = certify(
        config.beam, sigma_rad=config.sigma_rad, method=inside, conditions=TRANSPORT_CONDITIONS
    )
    return ResidualBase(
        controller=TannerController(
            beam=config.beam,
            robot=config.believed_robot,
            task=config.task,
            certificate=certificate,
            params=GENTLE_PARAMS,
        ),
        protection=certificate,
        authority=certified_authority(certificate, config, authority),
    )


def corrected_controller(name: str, config: TransportConfig) -> Controller:
    """Return a registered controller for an environment.

    Raises:
        ParameterError: there is none of that name, or it is made for another inner loop.
    """
    controllers = registered_controllers()
    require_choice("base", name, tuple(controllers))
    controller = make_controller(controllers[name], config)
    wanted = inner_loop_of(name, controller)
    if wanted != config.inner_loop:
        raise ParameterError(
            "base",
            name,
            f"a controller for the inner loop {config.inner_loop!r}",
            f"Make the environment with inner_loop={wanted!r}.",
        )
    return controller


def certified_authority(
    certificate: Certificate, config: TransportConfig, authority: float
) -> float:
    """Return the largest correction of a normalized action, ``authority`` certified accelerations.

    Raises:
        ParameterError: an authority that is not positive.
    """
    authority = require_positive("authority", authority)
    limit = config.task.max_acceleration_m_s2
    return min(authority * certificate.acceleration_bound / limit, 1.0)


def filter_authority(authority: float) -> float:
    """Return the largest correction of a normalized action inside a filter.

    Raises:
        ParameterError: an authority that is not positive.
    """
    return min(require_positive("authority", authority), 1.0)


@lru_cache(maxsize=4)
def shared_filter(config: TransportConfig, name: str, delay: int) -> StorageFilter:
    """Return the filter of a run's environments; training and evaluation share it."""
    return filter_for(config, kind=STORAGE_FILTERS[name], delay_periods=delay)
