"""Models that SB3 or rl_zoo3 saved. Loading one runs whatever its maker put into its pickles."""

from __future__ import annotations

import hashlib
import importlib
import json
import pickle
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import State
from defmanip_gym.baselines.learned.sb3_normalization import (
    missing_normalization,
    normalization_of,
    was_normalized,
)
from defmanip_gym.errors import AgentFileError

Array = NDArray[np.float64]

# A setting that a model of this class has and those after it have not; recurrent and maskable
# PPO, which differ, have policies outside of SB3 itself.
_MARKS = {
    "TQC": ("sb3_contrib", "top_quantiles_to_drop_per_net"),
    "TD3": ("stable_baselines3", "target_policy_noise"),
    "SAC": ("stable_baselines3", "target_entropy"),
    "PPO": ("stable_baselines3", "clip_range"),
}


class Sb3Controller:
    """An SB3 model with the normalization that it was trained with.

    Args:
        model: a loaded SB3 algorithm.
        normalization: SB3's ``VecNormalize`` of its training, or None.
        digest: of the files they came from.
    """

    def __init__(self, model: Any, normalization: Any | None, digest: str) -> None:
        self.algorithm = type(model).__name__.lower()
        self.digest = digest
        self.observation_size = int(model.observation_space.shape[0])
        self._model, self._normalization = model, normalization

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return the model's action.

        Raises:
            AgentFileError: observations of another length than it was trained on.
        """
        if observation.shape[-1] != self.observation_size:
            raise AgentFileError(
                "observation size",
                observation.shape[-1],
                f"{self.observation_size}, as in training",
                "Use an agent trained on a beam with as many segments.",
            )
        if self._normalization is not None:
            observation = self._normalization.normalize_obs(observation)
        action, _ = self._model.predict(observation, deterministic=deterministic)
        return np.asarray(action, dtype=np.float64), state


def load_sb3_zip(path: Path, normalization: str | None = None) -> Sb3Controller:
    """Load a PPO, SAC, TQC or TD3 model, unpickling it: only call this for files you trust.

    Args:
        path: the zip file.
        normalization: the file of the ``VecNormalize`` that it was trained with, or "none"; by
            default it is looked for beside the zip file, under the names that SB3 and rl_zoo3 give
            it. It is unpickled, too.

    Raises:
        AgentFileError: no model of these, a damaged one, one for other spaces, one whose
            normalization is missing or not clear, or no SB3 here.
    """
    name = _algorithm(path)
    try:
        module = importlib.import_module(_MARKS[name][0])
    except ImportError as error:
        raise AgentFileError(
            "agent",
            str(path),
            f"a model of {_MARKS[name][0]}, which is not installed",
            "Install it with: pip install 'defmanip_gym[train]'.",
        ) from error
    model = _unpickled(path, name, lambda: getattr(module, name).load(path, device="cpu"))
    normalized = was_normalized(model)
    statistics = normalization_of(path, normalization, normalized)
    normalize = None
    if statistics is not None:
        normalize = _unpickled(
            statistics, "VecNormalize", lambda: pickle.loads(statistics.read_bytes())
        )
    if not getattr(normalize, "norm_obs", True):
        normalize = None  # it normalized rewards only
    if normalized and normalize is None:
        raise missing_normalization(path)
    _check_spaces(model, normalize, path)
    digest = hashlib.sha256(path.read_bytes())
    digest.update(b"" if statistics is None else statistics.read_bytes())
    return Sb3Controller(model, normalize, digest.hexdigest()[:8])


def _unpickled(path: Path, kind: str, load: Callable[[], Any]) -> Any:
    try:
        return load()
    except Exception as error:  # a foreign pickle can raise anything
        raise AgentFileError(
            "agent",
            str(path),
            f"a {kind} that SB3 saved",
            f"It is damaged or of another version: {type(error).__name__}: {error}.",
        ) from error


def _algorithm(path: Path) -> str:
    """Return the class that made a zip file, from its settings alone: nothing is unpickled."""
    try:
        with zipfile.ZipFile(path) as archive:
            settings = json.loads(archive.read("data"))
        policy = str(settings["policy_class"]["__module__"])
    except (OSError, KeyError, TypeError, ValueError, RecursionError, zipfile.BadZipFile) as error:
        raise AgentFileError(
            "agent", str(path), "a zip file that SB3 saved", f"It is damaged or foreign: {error}."
        ) from error
    return _class_of(settings, policy, path)


def _class_of(settings: Mapping[str, Any], policy: str, path: Path) -> str:
    for name, (package, mark) in _MARKS.items():
        if mark in settings and policy.partition(".")[0] == package:
            return name
    raise AgentFileError(
        "agent", str(path), "a model of PPO, SAC, TQC or TD3", f"Its policy is of {policy}."
    )


def _check_spaces(model: Any, normalization: Any, path: Path) -> None:
    """Raise AgentFileError unless all takes flat observations of one length and makes actions."""
    shape, actions = model.observation_space.shape, model.action_space
    fits = shape is not None and len(shape) == 1 and getattr(actions, "shape", None) == (3,)
    if not fits or not np.allclose([actions.low, actions.high], [[-1.0] * 3, [1.0] * 3]):
        raise AgentFileError(
            "agent",
            f"{path}: {model.observation_space} to {actions}",
            "flat observations and three actions in [-1, 1]",
            "It was trained on another environment.",
        )
    mean: Any = getattr(getattr(normalization, "obs_rms", None), "mean", None)
    if normalization is not None and np.shape(mean) != shape:
        raise AgentFileError(
            "normalization",
            f"{path}: {type(normalization).__name__} of shape {np.shape(mean)}",
            f"VecNormalize with observations of {shape}",
            "Put the statistics of the same training beside the zip file.",
        )
