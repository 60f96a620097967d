"""What a residual policy trains in: its actions correct the paper's controller in a certificate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import State
from defmanip_gym.baselines.residual import corrected
from defmanip_gym.baselines.tanner import TannerController
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, Certificate, certify
from defmanip_gym.wrappers.nu_max_scaling import (
    NuMaxActionScaling,
    NuMaxVectorActionScaling,
    transport_config,
)

Array = NDArray[np.float64]


def residual_authority(certificate: Certificate, config: TransportConfig) -> float:
    """Return the largest correction of a normalized action: the certified acceleration."""
    return min(certificate.acceleration_bound / config.task.max_acceleration_m_s2, 1.0)


class ResidualVectorAction(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """The same as :class:`ResidualAction` for a batch, in SAME_STEP mode.

    Args:
        env: a batched DeformTransport environment in task mode.
        certificate: method that computes what base controller and wrapper keep to.

    Raises:
        CertificateError: there is no such certificate for the environment's beam.
        ParameterError: the environment resets in another way.
    """

    def __init__(
        self, env: gymnasium.vector.VectorEnv[Any, Any, Any], certificate: str = "phase_plane"
    ) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ParameterError(
                "autoreset_mode", mode, "AutoresetMode.SAME_STEP", "Make the batch in that mode."
            )
        base, bound = _base_and_certificate(env, certificate)
        super().__init__(NuMaxVectorActionScaling(env, bound))
        self._base = base
        self._authority = residual_authority(bound, transport_config(env))
        self._state: State | None = None
        self._action: Array | None = None

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start episodes; all, or those of ``options["reset_mask"]``."""
        observation, info = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        mask = (options or {}).get("reset_mask")
        self._decide(observation, np.ones(self.num_envs, dtype=bool) if mask is None else mask)
        return observation, info

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step with the corrected actions."""
        if self._action is None:
            raise ResetNeeded("Call reset() before the first step().")
        observation, reward, terminated, truncated, info = self.env.step(
            corrected(self._action, actions, self._authority)
        )
        self._decide(observation, terminated | truncated)
        return observation, reward, terminated, truncated, info

    def _decide(self, observation: Array, started: NDArray[np.bool_]) -> None:
        self._action, self._state = self._base.predict(observation, self._state, started)


class ResidualAction(
    gymnasium.Wrapper[Array, Array, Array, Array], gymnasium.utils.RecordConstructorArgs
):
    """Makes the action a correction of the paper's controller, and certifies the sum.

    The controller knows the environment's robot and beam and keeps to the certificate's bounds. An
    action adds up to the certified acceleration to each axis of its command, and
    :class:`~defmanip_gym.wrappers.nu_max_scaling.NuMaxActionScaling` brings the sum back into the
    certificate.

    Args:
        env: a DeformTransport environment in task mode.
        certificate: method that computes what base controller and wrapper keep to.

    Raises:
        CertificateError: there is no such certificate for the environment's beam.
    """

    vector_wrapper = ResidualVectorAction

    def __init__(
        self, env: gymnasium.Env[Array, Array], certificate: str = "phase_plane"
    ) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self, certificate=certificate)
        base, bound = _base_and_certificate(env, certificate)
        super().__init__(NuMaxActionScaling(env, bound))
        self._base = base
        self._authority = residual_authority(bound, transport_config(env))
        self._state: State | None = None
        self._action: Array | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._action, self._state = self._base.predict(observation)
        return observation, info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Step with the corrected action."""
        if self._action is None:
            raise ResetNeeded("Call reset() before the first step().")
        observation, reward, terminated, truncated, info = self.env.step(
            corrected(self._action, action, self._authority)
        )
        self._action, self._state = self._base.predict(observation, self._state)
        return observation, float(reward), terminated, truncated, info


def _base_and_certificate(env: Any, method: str) -> tuple[TannerController, Certificate]:
    config = transport_config(env)
    certificate = certify(
        config.beam, sigma_rad=config.sigma_rad, method=method, conditions=TRANSPORT_CONDITIONS
    )
    controller = TannerController(
        beam=config.beam, robot=config.believed_robot, task=config.task, certificate=certificate
    )
    return controller, certificate
