"""Actuators that are late: every action takes effect some control periods after it was sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError, StateError
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
        periods: control periods that an action takes; zero changes nothing. Or the fewest and the
            most, between which each episode draws its own from its generator (after its start).

    Raises:
        ParameterError: periods that are not a whole number, or two.
    """

    remembers = ("_under_way", "_delays", "_ended", "_is_started")

    def __init__(
        self, env: gymnasium.vector.VectorEnv[Any, Any, Any], periods: int | tuple[int, int]
    ) -> None:
        self._fewest, self.periods = _required(periods)
        super().__init__(env)
        shape = env.action_space.shape or (env.num_envs,)
        self._under_way = np.zeros((self.periods, *shape))  # the last was sent a period ago
        self._delays = np.full(env.num_envs, self.periods)
        self._ended = np.zeros(env.num_envs, dtype=bool)
        self._is_started = False

    @property
    def keeps_actions(self) -> bool:
        """Whether every action arrives as it was sent."""
        return self.periods == 0

    @property
    def is_drawn(self) -> bool:
        """Whether episodes differ by their delay."""
        return self._fewest < self.periods

    @property
    def delays(self) -> NDArray[np.int64]:
        """Control periods that an action takes in each episode, (n,)."""
        return self._delays.copy()

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
        """Step with the actions that were sent ``delays`` steps ago.

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
        arriving = under_way[self.periods - self._delays, np.arange(self.num_envs)]
        observation, reward, terminated, truncated, info = self.env.step(arriving)
        ended = terminated | truncated
        if is_next_step:
            self._begin(self._ended)
        elif mode is AutoresetMode.SAME_STEP:
            self._begin(ended)
        self._ended = ended
        return observation, reward, terminated, truncated, info

    def require_memory(self, memory: Mapping[str, Any]) -> None:
        """Raise StateError if this wrapper cannot be late as a memory says.

        Filters have been told by how much it is, and whether by the same in all episodes.
        """
        delays, under_way = (np.asarray(memory[name]) for name in ("_delays", "_under_way"))
        fits = delays.shape == (self.num_envs,) and under_way.shape == self._under_way.shape
        if not fits or (delays < self._fewest).any() or (delays > self.periods).any():
            raise StateError(
                "delays of the state",
                delays.tolist(),
                f"{self._fewest} to {self.periods} periods in each of {self.num_envs} episodes",
                "Take it from get_state of an environment with the same ActionDelay.",
            )

    def _begin(self, started: BoolArray) -> None:
        self._under_way[:, started] = 0.0
        if self.is_drawn:
            generators: Any = self.env.unwrapped
            for index in np.flatnonzero(started):
                generator: np.random.Generator = generators.np_random[index]
                self._delays[index] = generator.integers(self._fewest, self.periods + 1)


def _required(periods: object) -> tuple[int, int]:
    """Return the fewest and the most periods."""
    several = isinstance(periods, Sequence) or np.ndim(periods) > 0  # type: ignore[arg-type]
    ends: Any = periods if several else (periods, periods)
    if isinstance(ends, str) or len(ends) != 2:
        raise ParameterError("periods", periods, "a whole number, or two", "Give (fewest, most).")
    fewest = require_whole("periods", ends[0], 0, _MOST_PERIODS)
    return fewest, require_whole("periods", ends[1], fewest, _MOST_PERIODS)
