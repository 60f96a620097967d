"""Any safety filter around any controller: one wrapper for one episode, one for a batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.theory.filters.family import require_filter
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.wrappers.filtering import ROUNDING_M_S2, Filtered, Filtering
from defmanip_gym.wrappers.transport import action_changers, delay_periods, transport_config

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class SafetyFilterWrapper(
    gymnasium.Wrapper[Array, Array, Array, Array], gymnasium.utils.RecordConstructorArgs
):
    """Lets every action of a single environment through a safety filter.

    ``info`` gains ``wished_action`` and ``applied_action``, ``intervened`` (bool),
    ``correction_m_s2`` (change of w), ``filter_margin`` (share of what the filter keeps that is
    left), and ``filter_applies`` with ``filter_reason``: whether all that the filter takes for
    granted holds in this episode as far as configuration, wrappers inside, start and motion tell
    by now, and if not, why, in words. ``filtering`` holds the running counts.

    Args:
        env: a DeformTransport environment in task mode.
        safety_filter: that is enforced; or its ``specification``, a mapping.

    Raises:
        CertificateError: the filter does not fit the environment.
    """

    remembers = ("_observation", "filtering")

    def __init__(
        self,
        env: gymnasium.Env[Array, Array],
        safety_filter: SafetyFilter | Mapping[str, Any],
    ) -> None:
        safety_filter = require_filter("safety_filter", safety_filter)
        if type(self) is SafetyFilterWrapper:
            gymnasium.utils.RecordConstructorArgs.__init__(
                self, safety_filter=safety_filter.specification
            )
        super().__init__(env)
        self.filtering = Filtering(
            transport_config(env),
            safety_filter,
            action_changers=action_changers(env),
            delay_periods=delay_periods(env),
        )
        self._observation: Array | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._observation = observation.copy()  # the caller's own from now on
        self.filtering.begin(observation[None], np.array([True]))
        return observation, info | self._report(Filtered.nothing(1))

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Step with the action that the filter allows."""
        if self._observation is None:
            raise ResetNeeded("Call reset() before the first step().")
        filtered = self.filtering.certify([action], self._observation[None])
        observation, reward, terminated, truncated, info = self.env.step(filtered.applied[0])
        self._observation = observation.copy()  # the caller's own from now on
        self.filtering.conclude(observation[None])
        return observation, float(reward), terminated, truncated, info | self._report(filtered)

    def _report(self, filtered: Filtered) -> dict[str, Any]:
        correction = float(filtered.correction_m_s2[0])
        return {
            "wished_action": filtered.wished[0],
            "applied_action": filtered.applied[0],
            "intervened": correction > ROUNDING_M_S2,
            "correction_m_s2": correction,
            "filter_margin": float(filtered.margin[0]),
            "filter_applies": bool(self.filtering.applies[0]),
            "filter_reason": str(self.filtering.reasons[0]),
        }


class SafetyFilterVectorWrapper(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """The same for a batch; every added info key holds an array over the episodes.

    Args:
        env: a batched DeformTransport environment in task mode.
        safety_filter: that is enforced; or its ``specification``, a mapping.

    Raises:
        CertificateError: the filter does not fit the environment.
    """

    remembers = ("_observation", "_ended", "filtering")

    def __init__(
        self,
        env: gymnasium.vector.VectorEnv[Any, Any, Any],
        safety_filter: SafetyFilter | Mapping[str, Any],
    ) -> None:
        super().__init__(env)
        self.filtering = Filtering(
            transport_config(env),
            require_filter("safety_filter", safety_filter),
            env.num_envs,
            action_changers(env),
            delay_periods(env),
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
        self._begin(observation.copy(), started)
        return observation, info | self._report(Filtered.nothing(self.num_envs))

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step with the actions that the filter allows."""
        if self._observation is None:
            raise ResetNeeded("Call reset() before the first step().")
        mode = self.env.metadata["autoreset_mode"]
        waits = mode is AutoresetMode.NEXT_STEP and self._ended.any()
        idle = self._ended if waits else None
        filtered = self.filtering.certify(actions, self._observation, idle)
        observation, reward, terminated, truncated, info = self.env.step(filtered.applied)
        ended = terminated | truncated
        own = observation.copy()  # the caller's own from now on
        self.filtering.conclude(info.get("final_obs", own), idle)
        if "final_info" in info:
            info["final_info"] |= self._report(filtered)
        if mode is AutoresetMode.NEXT_STEP:
            started, self._ended = self._ended, ended
        else:
            started = ended if mode is AutoresetMode.SAME_STEP else np.zeros_like(ended)
        self._begin(own, started)
        return observation, reward, terminated, truncated, info | self._report(filtered)

    def _begin(self, observation: Array, started: BoolArray) -> None:
        self._observation = observation
        self.filtering.begin(observation, started)

    def _report(self, filtered: Filtered) -> dict[str, Any]:
        return {
            "wished_action": filtered.wished,
            "applied_action": filtered.applied,
            "intervened": filtered.correction_m_s2 > ROUNDING_M_S2,
            "correction_m_s2": filtered.correction_m_s2,
            "filter_margin": filtered.margin,
            "filter_applies": self.filtering.applies,
            "filter_reason": self.filtering.reasons.copy(),
        }
