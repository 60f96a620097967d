"""ν_max as an action-scaling wrapper: no policy inside it can violate the certificate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.validation import plain
from defmanip_gym.wrappers.action_scaling import ROUNDING_M_S2, ActionScaling
from defmanip_gym.wrappers.transport import action_changers, transport_config

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class NuMaxActionScaling(
    gymnasium.Wrapper[Array, Array, Array, Array], gymnasium.utils.RecordConstructorArgs
):
    """Keeps every action of a single environment within a certificate.

    ``info`` gains ``intervened`` (bool), ``intervention_m_s2`` (change of w), and
    ``certificate_applies`` with ``certificate_reason``: whether all that the certificate takes for
    granted holds in this episode as far as configuration, wrappers inside, start and motion tell
    by now, and if not, why, in words. ``scaling`` holds the running counts.

    Args:
        env: a DeformTransport environment in task mode.
        certificate: the bounds to enforce; or a mapping of its fields, as the JSON of a
            specification holds it.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    remembers = ("_observation", "scaling")

    def __init__(self, env: gymnasium.Env[Array, Array], certificate: Certificate) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self, certificate=plain(certificate))
        super().__init__(env)
        self.scaling = ActionScaling(
            transport_config(env), certificate, action_changers=action_changers(env)
        )
        self._observation: Array | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._observation = observation.copy()  # the caller's own from now on
        self.scaling.begin(observation[None], np.array([True]))
        return observation, info | self._report(0.0)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Step with the action scaled into the certificate."""
        if self._observation is None:
            raise ResetNeeded("Call reset() before the first step().")
        certified, change = self.scaling.scale([action], self._observation[None])
        observation, reward, terminated, truncated, info = self.env.step(certified[0])
        self._observation = observation.copy()  # the caller's own from now on
        self.scaling.conclude(observation[None])
        return observation, float(reward), terminated, truncated, info | self._report(change[0])

    def _report(self, change: float) -> dict[str, Any]:
        return {
            "intervened": bool(change > ROUNDING_M_S2),
            "intervention_m_s2": float(change),
            "certificate_applies": bool(self.scaling.applies[0]),
            "certificate_reason": str(self.scaling.reasons[0]),
        }


class NuMaxVectorActionScaling(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """The same for a batch; every added info key holds an array over the episodes.

    Args:
        env: a batched DeformTransport environment in task mode.
        certificate: the bounds to enforce; or a mapping of its fields, as the JSON of a
            specification holds it.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    remembers = ("_observation", "_ended", "scaling")

    def __init__(
        self, env: gymnasium.vector.VectorEnv[Any, Any, Any], certificate: Certificate
    ) -> None:
        super().__init__(env)
        self.scaling = ActionScaling(
            transport_config(env), certificate, env.num_envs, action_changers(env)
        )
        self._observation: Array | None = None
        self._ended = np.zeros(env.num_envs, dtype=bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start episodes; all, or those of ``options["reset_mask"]``."""
        observation, info = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        mask = (options or {}).get("reset_mask")
        started = np.ones(self.num_envs, dtype=bool) if mask is None else np.asarray(mask)
        self._ended = self._ended & ~started
        self._begin(observation, started)
        return observation, info | self._report(np.zeros(self.num_envs))

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step with the actions scaled into the certificate."""
        if self._observation is None:
            raise ResetNeeded("Call reset() before the first step().")
        mode = self.env.metadata["autoreset_mode"]
        idle = self._ended if mode is AutoresetMode.NEXT_STEP else None
        certified, change = self.scaling.scale(actions, self._observation, idle)
        observation, reward, terminated, truncated, info = self.env.step(certified)
        ended = terminated | truncated
        self.scaling.conclude(info.get("final_obs", observation), idle)
        if "final_info" in info:
            info["final_info"] |= self._report(change)
        if mode is AutoresetMode.NEXT_STEP:
            started, self._ended = self._ended, ended
        else:
            started = ended if mode is AutoresetMode.SAME_STEP else np.zeros_like(ended)
        self._begin(observation, started)
        return observation, reward, terminated, truncated, info | self._report(change)

    def _begin(self, observation: Array, started: BoolArray) -> None:
        self._observation = observation.copy()  # the caller's own from now on
        self.scaling.begin(observation, started)

    def _report(self, change: Array) -> dict[str, Any]:
        return {
            "intervened": change > ROUNDING_M_S2,
            "intervention_m_s2": change,
            "certificate_applies": self.scaling.applies,
            "certificate_reason": self.scaling.reasons.copy(),
        }
