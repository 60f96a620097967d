"""What both faces of the engine offer beside Gymnasium's methods: states, copies, MuJoCo."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from typing import Any, Self

import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.validation import require_whole


class EpisodeAccess:
    """Mixed into environments that have an ``engine``.

    Copies and pickles are made from the constructor's arguments, and go on from the same state.
    """

    engine: TransportEngine
    _spec: EnvSpec | None = None
    _arguments: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        """Note what the environment is made with."""
        made = super().__new__(cls)
        made._arguments = args, kwargs
        return made

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made it, in values that JSON holds."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec and replace(spec, kwargs=_without_numpy(spec.kwargs))

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's model, to be read: what is simulated is a copy of it, and drawn beams differ."""
        return self.engine.simulation.model

    @property
    def dt(self) -> float:
        """Seconds from one step to the next, the control period."""
        return self.engine.config.task.control_period_s

    @property
    def frame_skip(self) -> int:
        """Physics steps in a control period."""
        return self.engine.config.task.substeps

    def get_model(self, index: int = 0) -> mujoco.MjModel:
        """Return a copy of MuJoCo's model with the beam that an episode carries.

        Raises:
            ParameterError: there is no such episode.
        """
        return self._materialized(index)[0]

    def get_data(self, index: int = 0) -> mujoco.MjData:
        """Return MuJoCo's data of an episode as it is now, with all derived fields: a copy.

        Raises:
            ParameterError: there is no such episode.
        """
        return self._materialized(index)[1]

    def get_state(self) -> dict[str, Any]:
        """Return all that the future of the episodes depends on: dicts, lists, numbers, arrays.

        Wrappers have memories of their own; :func:`defmanip_gym.get_state` asks them, too.
        """
        return self.engine.get_state()

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned, here or in an environment of the same make.

        From there on the same actions give the same episodes, to the last bit. Parameters are not
        part of it: a planner's own model may believe in another robot or beam. Only drawn beams
        are carried over.

        Raises:
            StateError: it is of other beam segments or another number of episodes.
        """
        if isinstance(state, Mapping):  # of a batch, when it is this environment's n = 1
            state = {key: value for key, value in state.items() if key != "ended"}
        self.engine.set_state(state)

    def __getstate__(self) -> dict[str, Any]:
        return {"arguments": self._arguments, "spec": self.spec, "state": self.get_state()}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        args, kwargs = kept["arguments"]
        self.__dict__.update(vars(type(self)(*args, **kwargs)))
        self.spec = kept["spec"]
        self.set_state(kept["state"])

    def _materialized(self, index: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        index = require_whole("index", index, 0, self.engine.num_envs - 1)
        model = copy.copy(self.model)
        data = mujoco.MjData(model)
        self.engine.simulation.materialize(index, model, data)
        return model, data


def frames_per_second(config: TransportConfig) -> int:
    """Return how many images a second show an episode at its own speed."""
    return max(1, round(1 / config.task.control_period_s))


def _without_numpy(value: Any) -> Any:
    """Return arguments with Python's own numbers, lists and texts, as JSON has no others."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _without_numpy(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_without_numpy(each) for each in value)
    return value
