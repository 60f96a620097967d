"""Stable-Baselines3's ``VecEnv`` over the batched environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvStepReturn

from defmanip_gym.errors import ParameterError

Array = NDArray[np.float64]

_EPISODE_KEYS = ("is_success", "cost", "constraint_margin")


class Sb3VecEnv(VecEnv):
    """Presents a Gymnasium ``VectorEnv`` in SAME_STEP mode to SB3.

    Per-episode info dicts are built for ended episodes only: SB3 reads ``terminal_observation``,
    ``TimeLimit.truncated`` and ``episode`` from them, and nothing from the others.

    Args:
        env: the batched environment.

    Raises:
        ParameterError: the environment resets in another way.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        if env.metadata["autoreset_mode"] is not AutoresetMode.SAME_STEP:
            raise ParameterError(
                "autoreset_mode",
                env.metadata["autoreset_mode"],
                "AutoresetMode.SAME_STEP",
                "SB3 expects ended episodes to be reset within the step.",
            )
        self.env = env
        self._actions: Array
        self._returns = np.zeros(env.num_envs)
        self._lengths = np.zeros(env.num_envs, dtype=np.int64)
        self._costs = np.zeros(env.num_envs)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Array:
        """Start all episodes anew with the seeds of ``seed``, if any."""
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observation, _ = self.env.reset(seed=seeds)  # type: ignore[arg-type]
        self._reset_seeds()
        self._reset_options()
        for tally in (self._returns, self._lengths, self._costs):
            tally[:] = 0
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for ``step_wait``."""
        self._actions = np.asarray(actions, dtype=np.float64)

    def step_wait(self) -> VecEnvStepReturn:
        """Step the batch."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        ended = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self._returns += reward
        self._lengths += 1
        last = info.get("final_info", info)
        self._costs += last["cost"]
        for i in np.flatnonzero(ended):
            infos[i] = {
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i]),
                "episode": {
                    "r": float(self._returns[i]),
                    "l": int(self._lengths[i]),
                    "cost": float(self._costs[i]),
                },
                **{key: last[key][i].item() for key in _EPISODE_KEYS},
            }
        for tally in (self._returns, self._lengths, self._costs):
            tally[ended] = 0
        return observation, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        """Close the batch."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return the batch's attribute once for each index."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse: the episodes of a batch share their attributes."""
        raise AttributeError(f"{attr_name} belongs to the whole batch; set it on `.env`.")

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call the batch's method and return its result once for each index."""
        result = getattr(self.env, method_name)(*args, **kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]],
        indices: VecEnvIndices = None,
    ) -> list[bool]:
        """Whether episodes are wrapped; true of ``Monitor``, whose statistics are kept here."""
        from stable_baselines3.common.monitor import Monitor

        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return an image of each episode."""
        return self.env.render() or ()  # type: ignore[return-value]
