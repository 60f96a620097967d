"""What a residual policy trains in: its actions correct a controller, inside a protection."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import State
from defmanip_gym.baselines.residual import corrected, required_periods
from defmanip_gym.baselines.residual_base import PAPERS, residual_base
from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import require_positive
from defmanip_gym.wrappers.actions import finite_actions

if TYPE_CHECKING:
    from defmanip_gym.envs.vector import DeformTransportVectorEnv

Array = NDArray[np.float64]

_ENDINGS = ("final_obs", "final_info", "_final_obs", "_final_info")


class ResidualVectorAction(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """The same as :class:`ResidualAction` for a batch, in SAME_STEP mode.

    Where an episode ends before its decision's time is over, its successor begins with the rest of
    that time, uncorrected and unrewarded.

    Args:
        env: a batched DeformTransport environment in task mode.
        inside: as for ``residual_base``, whatever the sum stays inside.
        decision_periods: control periods that an action is held for.
        authority: largest correction, as for ``residual_base``.
        base: registered controller that is corrected.

    Raises:
        CertificateError: there is no such certificate or filter for the environment.
        ParameterError: the environment resets in another way, or no whole number of periods.
    """

    remembers = ("_state", "_action")

    def __init__(
        self,
        env: gymnasium.vector.VectorEnv[Any, Any, Any],
        inside: str = "phase_plane",
        decision_periods: int = 1,
        authority: float = 1.0,
        base: str = PAPERS,
    ) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ParameterError(
                "autoreset_mode",
                mode,
                "AutoresetMode.SAME_STEP",
                "Make the batch by make_vec(..., autoreset_mode='SameStep').",
            )
        decision_periods = required_periods(decision_periods)
        below = residual_base(env, base=base, inside=inside, authority=authority)
        super().__init__(below.around_batch(env))
        self._base, self._decision_periods = below.controller, decision_periods
        self._authority = below.authority
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

    @property
    def max_episode_steps(self) -> int:
        """Decisions until truncation."""
        batch = cast("DeformTransportVectorEnv", self.unwrapped)
        return math.ceil(batch.max_episode_steps / self._decision_periods)

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step with the corrected actions for the time of a decision.

        Raises:
            ActionError: actions that are not finite or of another shape.
            ResetNeeded: no episode has been started.
        """
        actions = finite_actions(actions, np.ones(self.num_envs, dtype=bool))
        rewards, cost = np.zeros((2, self.num_envs))
        terminated, truncated = np.zeros((2, self.num_envs), dtype=bool)
        last: dict[str, Any] = {}
        for _ in range(self._decision_periods):
            running = ~(terminated | truncated)
            observation, reward, ended, cut, info = self._step_once(
                np.where(running[:, None], actions, 0.0)
            )
            rewards += np.where(running, reward, 0.0)
            fresh = running & (ended | cut)
            spent = info["cost"]
            if fresh.any():
                spent = np.where(fresh, info["final_info"]["cost"], spent)
                _keep(last, info, fresh)
            cost += np.where(running, spent, 0.0)
            terminated |= fresh & ended
            truncated |= fresh & cut
        info = {key: value for key, value in info.items() if key not in _ENDINGS}
        info["cost"] = np.where(terminated | truncated, 0.0, cost)
        if last:
            last["final_info"]["cost"] = cost
        return observation, rewards, terminated, truncated, info | last

    def _step_once(
        self, residual: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        if self._action is None:
            raise ResetNeeded("Call reset() before the first step().")
        observation, reward, terminated, truncated, info = self.env.step(
            corrected(self._action, residual, self._authority)
        )
        self._decide(observation, terminated | truncated)
        return observation, reward, terminated, truncated, info

    def _decide(self, observation: Array, started: NDArray[np.bool_]) -> None:
        self._action, self._state = self._base.predict(observation, self._state, started)


def _keep(last: dict[str, Any], info: dict[str, Any], fresh: NDArray[np.bool_]) -> None:
    """Add the endings of the episodes ``fresh`` to those of this decision."""
    for key in _ENDINGS:
        if key not in last:
            last[key] = info[key]
        elif isinstance(last[key], dict):
            for name, values in last[key].items():
                values[fresh] = info[key][name][fresh]
        else:
            last[key][fresh] = info[key][fresh]


class ResidualAction(
    gymnasium.Wrapper[Array, Array, Array, Array], gymnasium.utils.RecordConstructorArgs
):
    """Makes the action a correction of a controller's, and keeps the sum inside a protection.

    The controller knows the environment's robot and beam. An action adds to each axis of its
    command, and a safety filter, or a certificate's bound, brings the sum back to what is allowed.
    An action is held for some control periods, in which rewards and costs add up: the controller's
    own feedback hides what a correction of a single period does.

    Args:
        env: a DeformTransport environment in task mode.
        inside: as for ``residual_base``, whatever the sum stays inside.
        decision_periods: control periods that an action is held for.
        authority: largest correction, as for ``residual_base``.
        base: registered controller that is corrected.

    Raises:
        CertificateError: there is no such certificate or filter for the environment.
        ParameterError: no whole number of periods.
    """

    vector_wrapper = ResidualVectorAction
    remembers = ("_state", "_action")

    def __init__(
        self,
        env: gymnasium.Env[Array, Array],
        inside: str = "phase_plane",
        decision_periods: int = 1,
        authority: float = 1.0,
        base: str = PAPERS,
    ) -> None:
        decision_periods = required_periods(decision_periods)
        authority = require_positive("authority", authority)
        gymnasium.utils.RecordConstructorArgs.__init__(
            self,
            inside=inside,
            decision_periods=decision_periods,
            authority=authority,
            base=base,
        )
        below = residual_base(env, base=base, inside=inside, authority=authority)
        super().__init__(below.around(env))
        self._base, self._decision_periods = below.controller, decision_periods
        self._authority = below.authority
        self._state: State | None = None
        self._action: Array | None = None

    @property
    def spec(self) -> EnvSpec | None:  # type: ignore[override]
        """How to make it again; the protection's wrapper comes with it."""
        spec = copy.deepcopy(self.env.env.spec)  # type: ignore[attr-defined]
        if spec is not None:
            spec.additional_wrappers += (self.wrapper_spec(**self._saved_kwargs),)
        return spec

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._action, self._state = self._base.predict(observation)
        return observation, info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Step with the corrected action for the time of a decision, or until the end.

        Raises:
            ActionError: an action that is not finite or of another shape.
            ResetNeeded: no episode has been started.
        """
        if self._action is None:
            raise ResetNeeded("Call reset() before the first step().")
        (residual,) = finite_actions([action], np.array([True]))
        total, cost = 0.0, 0.0
        for _ in range(self._decision_periods):
            observation, reward, terminated, truncated, info = self.env.step(
                corrected(self._action, residual, self._authority)
            )
            self._action, self._state = self._base.predict(observation, self._state)
            total, cost = total + float(reward), cost + info["cost"]
            if terminated or truncated:
                break
        return observation, total, terminated, truncated, info | {"cost": cost}
