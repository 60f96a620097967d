"""Actuators that are late: every action takes effect some control periods after it was sent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.validation import require_whole
from defmanip_gym.wrappers.actions import finite_actions

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_MOST_PERIODS = 1000


class ActionDelay(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """Holds each action of a batch back for some control periods; until then actions are zero.

    The delay is the actuators', so a certificate's wrapper goes around it. Every episode begins
    with nothing on its way, in all of Gymnasium's autoreset modes.

    Args:
        env: a batched environment.
        periods: control periods that an action takes; zero changes nothing.

    Raises:
        ParameterError: periods that are not a whole number.
    """

    remembers = ("_under_way", "_ended", "_is_started")

    def __init__(self, env: gymnasium.vector.VectorEnv[Any, Any, Any], periods: int) -> None:
        periods = require_whole("periods", periods, 0, _MOST_PERIODS)
        super().__init__(env)
        self.periods = periods
        shape = env.action_space.shape or (env.num_envs,)
        self._under_way = np.zeros((periods, *shape))  # the first is the next to take effect
        self._ended = np.zeros(env.num_envs, dtype=bool)
        self._is_started = False

    @property
    def keeps_actions(self) -> bool:
        """Whether every action arrives as it was sent."""
        return self.periods == 0

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
        self._begin(started)
        self._ended = self._ended & ~started
        self._is_started = True
        return observation, info

    def step(self, actions: Array) -> tuple[Array, Array, BoolArray, BoolArray, dict[str, Any]]:
        """Step with the actions that were sent ``periods`` steps ago.

        Raises:
            ActionError: actions that are not finite or of another shape.
            ResetNeeded: no episode has been started.
        """
        if not self._is_started:
            raise ResetNeeded("Call reset() before the first step().")
        mode = self.env.metadata["autoreset_mode"]
        is_next_step = mode is AutoresetMode.NEXT_STEP
        idle = self._ended if is_next_step else np.zeros(self.num_envs, dtype=bool)
        sent = finite_actions(actions, ~idle, self._under_way.shape[2:])
        under_way = np.concatenate((self._under_way, sent[None]))
        self._under_way = under_way[1:]
        observation, reward, terminated, truncated, info = self.env.step(under_way[0])
        ended = terminated | truncated
        if is_next_step:
            self._begin(self._ended)
        elif mode is AutoresetMode.SAME_STEP:
            self._begin(ended)
        self._ended = ended
        return observation, reward, terminated, truncated, info

    def _begin(self, started: BoolArray) -> None:
        self._under_way[:, started] = 0.0
