"""Stable-Baselines3's ``VecEnv`` over the batched environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvStepReturn

from defmanip_gym.envs.state import get_state, set_state, wrappers
from defmanip_gym.errors import ParameterError, StartError
from defmanip_gym.validation import require_instance

Array = NDArray[np.float64]
Ids = NDArray[np.intp]

_SPACES = ("observation_space", "action_space")
_ONE_FOR_EACH = ("np_random", "np_random_seed", "render", "render_camera")


class Sb3VecEnv(VecEnv):
    """Presents a batched environment in SAME_STEP mode to SB3, without a loop over its episodes.

    To SB3 each episode is an environment. Attributes and methods are the batch's, looked for from
    the outermost wrapper inwards, and every index gets the same; what Gymnasium keeps for each
    episode (``np_random``, ``np_random_seed``), images and the spaces are those of the index.

    The info dict of an episode that ends holds what SB3 reads (``terminal_observation``,
    ``TimeLimit.truncated``, and ``episode`` with return, length and cost) and the environment's
    own info of its last step; those of the others hold ``cost`` where it is not zero. ``step_info``
    holds the info of all episodes as arrays. Episode statistics are kept here: no ``VecMonitor`` is
    needed.

    Args:
        env: the package's batched environment, with its vector wrappers if any.

    Raises:
        ParameterError: the environment resets in another way, as it does by default.

    Example:
        >>> import gymnasium
        >>> from stable_baselines3 import PPO
        >>> from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
        >>> env = gymnasium.make_vec(
        ...     "defmanip_gym:DeformTransport-v0", num_envs=64, autoreset_mode="SameStep"
        ... )
        >>> model = PPO("MlpPolicy", Sb3VecEnv(env), n_steps=32, batch_size=1024)
        >>> model.learn(1_000_000)  # doctest: +SKIP
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        require_instance("env", env, VectorEnv)
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ParameterError(
                "autoreset_mode",
                mode,
                "AutoresetMode.SAME_STEP",
                "SB3 expects ended episodes to be reset within the step: make the batch by "
                "make_vec(..., autoreset_mode='SameStep').",
            )
        self.env = env
        self.spec = env.spec
        self.step_info: dict[str, Any] = {}
        self._actions: NDArray[Any]
        self._returns = np.zeros(env.num_envs)
        self._lengths = np.zeros(env.num_envs, dtype=np.int64)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        # as the video recorder reads it
        self.metadata |= {"render_fps": env.metadata.get("render_fps", 30)}

    def reset(self) -> Array:
        """Start all episodes anew, with what ``seed`` and ``set_options`` asked for, if anything.

        Raises:
            StartError: options that the environment cannot take.
        """
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        options = _batch_options(self._options)
        try:
            observation, info = self.env.reset(seed=seeds, options=options)  # type: ignore[arg-type]
        finally:  # what was refused is not asked for again
            self._reset_seeds()
            self._reset_options()
        self._returns[:] = self._lengths[:] = 0
        self.step_info = info
        self.reset_infos = _rows(info, np.arange(self.num_envs))
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step the batch."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        ended = terminated | truncated
        # new ones: wrappers may write into any of them, and keep them (60 ns each)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self.step_info = info
        self._returns += reward
        self._lengths += 1
        for i in np.flatnonzero(info["cost"]):
            infos[i]["cost"] = float(info["cost"][i])
        ids = np.flatnonzero(ended)
        if len(ids):
            endings = self._endings(ids, info, truncated & ~terminated)
            for i, ending in zip(ids, endings, strict=True):
                infos[i] = ending
            self._returns[ids] = self._lengths[ids] = 0
        # SB3 adds the value of truncated episodes to the rewards in place: a copy
        return observation, reward.astype(np.float32), ended, infos

    def _endings(
        self, ids: Ids, info: dict[str, Any], truncated: NDArray[np.bool_]
    ) -> list[dict[str, Any]]:
        """Return the info dicts of the episodes that ended, and note the infos of their successors.

        Args:
            ids: the episodes, (k,).
            info: the batch's, with what they ended with in ``final_info``.
            truncated: which were truncated, (n,).
        """
        endings = _rows(info["final_info"], ids)
        columns = (
            info["final_obs"][ids],
            truncated[ids].tolist(),
            self._returns[ids].tolist(),
            self._lengths[ids].tolist(),
        )
        for ending, observation, cut, total, length in zip(endings, *columns, strict=True):
            ending["terminal_observation"] = observation
            ending["TimeLimit.truncated"] = cut
            ending["episode"] = {"r": total, "l": length, "cost": ending["episode_cost"]}
        for i, first in zip(ids, _rows(info, ids), strict=True):
            self.reset_infos[i] = first
        return endings

    def get_state(self) -> dict[str, Any] | None:
        """Return what the running episodes' future depends on; None where they cannot go on.

        So it is before the first reset, and where a wrapper does not name what it remembers.
        """
        is_fresh = any(seed is not None for seed in self._seeds)
        if is_fresh or not all(hasattr(type(layer), "remembers") for layer in wrappers(self.env)):
            return None
        tallies = [self._returns.copy(), self._lengths.copy()]
        return {"tallies": tallies, "batch": get_state(self.env)}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned."""
        self._returns, self._lengths = state["tallies"]
        set_state(self.env, state["batch"])
        self._reset_seeds()
        self._reset_options()

    def close(self) -> None:
        """Close the batch."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return the attribute of each index.

        Raises:
            AttributeError: neither the batch nor one of its wrappers has it.
        """
        if attr_name in _SPACES:
            attr_name = f"single_{attr_name}"
        value = getattr(self._layer_with(attr_name), attr_name)
        return self._of_each(attr_name, value, indices)

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the batch: where it is, or on the outermost wrapper if it is new.

        Raises:
            ParameterError: indices that leave episodes out: they share their attributes.
            AttributeError: it cannot be set.
        """
        if len({int(i) % self.num_envs for i in self._get_indices(indices)}) < self.num_envs:
            raise ParameterError(
                "indices",
                indices,
                "None, or all episodes",
                f"{attr_name} is set for the whole batch: its episodes share their attributes.",
            )
        layer = self._layer_with(attr_name) if self.has_attr(attr_name) else self.env
        setattr(layer, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call the batch's method once and return its result for each index.

        ``get_wrapper_attr``, ``has_wrapper_attr`` and ``set_wrapper_attr``, which only single
        environments have, do what ``get_attr``, ``has_attr`` and ``set_attr`` do.

        Raises:
            ParameterError: a method that would step, reset or close the episodes behind SB3's
                back.
            AttributeError: neither the batch nor one of its wrappers has it.
        """
        if method_name in ("reset", "step", "close"):
            raise ParameterError(
                "method_name",
                method_name,
                "a method that leaves the episodes as they are",
                f"Call {method_name} of the Sb3VecEnv, which does so for all of them.",
            )
        if method_name == "get_wrapper_attr":
            return self._get_wrapper_attr(*args, indices=indices, **kwargs)
        if method_name == "has_wrapper_attr":
            result: Any = self._has_wrapper_attr(*args, **kwargs)
        elif method_name == "set_wrapper_attr":
            result = self._set_wrapper_attr(*args, indices=indices, **kwargs)
        else:
            result = getattr(self._layer_with(method_name), method_name)(*args, **kwargs)
        return self._of_each(method_name, result, indices)

    def has_attr(self, attr_name: str) -> bool:
        """Whether the batch or one of its wrappers has the attribute."""
        return hasattr(self._layer_with(attr_name), attr_name)

    def _get_wrapper_attr(self, name: str, *, indices: VecEnvIndices) -> list[Any]:
        return self.get_attr(name, indices)

    def _has_wrapper_attr(self, name: str) -> bool:
        return self.has_attr(name)

    def _set_wrapper_attr(
        self, name: str, value: Any, *, force: bool = True, indices: VecEnvIndices
    ) -> bool:
        is_set = force or self.has_attr(name)
        if is_set:
            self.set_attr(name, value, indices)
        return is_set

    def _layer_with(self, name: str) -> VectorEnv[Any, Any, Any]:
        """Return the outermost layer that has the attribute, or the batch itself."""
        layer = self.env  # Gymnasium's vector wrappers do not hand attributes through
        while not hasattr(layer, name) and isinstance(layer, gymnasium.vector.VectorWrapper):
            layer = layer.env
        return layer

    def _of_each(self, name: str, value: Any, indices: VecEnvIndices) -> list[Any]:
        # by name, not by length: a tuple of two need not be one for each of two episodes
        is_shared = name not in _ONE_FOR_EACH or not isinstance(value, tuple)
        return [value if is_shared else value[i] for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """Whether the batch is in such a wrapper; true of ``Monitor``, whose work is done here."""
        layer, wrapped = self.env, wrapper_class is Monitor
        while isinstance(layer, gymnasium.vector.VectorWrapper):
            wrapped |= isinstance(layer, wrapper_class)
            layer = layer.env
        return [wrapped for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return an image of each episode."""
        return self.env.render() or ()  # type: ignore[return-value]


def _rows(info: dict[str, Any], ids: Ids) -> list[dict[str, Any]]:
    """Return the info dicts of single episodes, as plain numbers, from the arrays of a batch."""
    names = [
        name
        for name, value in info.items()
        if isinstance(value, np.ndarray) and value.ndim == 1 and not name.startswith("_")
    ]
    columns = [info[name][ids].tolist() for name in names]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def _batch_options(options: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return one dict of reset options for the batch from SB3's one for each episode.

    Raises:
        StartError: they differ in more than the numbers of their starts.
    """
    first = options[0]
    if all(one is first for one in options):  # a single dict was given
        return first or None
    if not any(options):
        return None
    starts = [one.get("start", "sampled") if set(one) <= {"start"} else None for one in options]
    if isinstance(starts[0], str) and all(isinstance(s, str) and s == starts[0] for s in starts):
        return {"start": starts[0]}
    if any(start is None or isinstance(start, str) for start in starts):
        raise StartError(
            "options",
            options,
            "one dict for all episodes, or a list with six numbers as every 'start'",
            "A batch takes named starts for all of its episodes or for none.",
        )
    return {"start": np.array(starts, dtype=np.float64)}
