"""Everything a run needs to go on as if it had not been interrupted, without pickle."""

from __future__ import annotations

import pickle
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file, recursive_getattr
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.errors import RunFolderError
from defmanip_gym.evaluation.seeds import training_seed
from defmanip_gym.training.callbacks import Resumable
from defmanip_gym.training.environment_state import environment_state, set_environment_state
from defmanip_gym.training.generators import generators_state, set_generators_state
from defmanip_gym.training.learner_state import (
    learner_state,
    normalization_state,
    set_learner_state,
    set_normalization_state,
)
from defmanip_gym.training.state_file import read_state, read_values, write_state

_MODEL = "model.zip"
_FORMAT = 2  # 1 had no generators, entropy coefficients and environments
# what a cut, edited or foreign file makes NumPy, torch and zipfile raise
_DAMAGE = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    RuntimeError,
    zipfile.BadZipFile,
    pickle.UnpicklingError,
)


def write_checkpoint(
    folder: Path,
    model: BaseAlgorithm,
    venv: VecNormalize,
    callbacks: Sequence[BaseCallback],
    total_timesteps: int,
) -> None:
    """Write the whole state of a run between two of its rollouts.

    Args:
        folder: an empty one.
        model: with its logger.
        venv: the training's environment.
        callbacks: the training's; those that are ``Resumable`` tell what to keep of them.
        total_timesteps: environment steps that the run is to have in the end.
    """
    model.save(folder / _MODEL)
    state = {
        "format": _FORMAT,
        "total_timesteps": total_timesteps,
        "learner": learner_state(model),
        "generators": generators_state(model),
        "normalization": normalization_state(venv),
        "environment": environment_state(venv),
        "callbacks": [_callback_state(callback) for callback in callbacks],
    }
    write_state(folder, state)


def read_checkpoint(
    folder: Path, model: BaseAlgorithm, venv: VecNormalize, callbacks: Sequence[BaseCallback]
) -> None:
    """Put a checkpoint into what was built from the same configuration, logger included.

    Raises:
        RunFolderError: the checkpoint is damaged, of another format, or of another shape.
    """
    with _refused(folder):
        _require_format(read_values(folder), folder)
        state = read_state(folder)
        _read_tensors(folder / _MODEL, model)
        set_learner_state(model, state["learner"])
        set_normalization_state(venv, state["normalization"])
        set_environment_state(venv, state["environment"])
        if state["environment"] is None:
            _begin_new_episodes(model, venv)
        for callback, kept in zip(callbacks, state["callbacks"], strict=True):
            callback.n_calls = kept["n_calls"]
            if isinstance(callback, Resumable):
                callback.set_state(kept["own"])
        set_generators_state(model, state["generators"])


def planned_timesteps(folder: Path) -> int:
    """Return how many environment steps the run of a checkpoint is to have in the end.

    Raises:
        RunFolderError: the checkpoint is damaged or of another format.
    """
    with _refused(folder):
        values = read_values(folder)
        _require_format(values, folder)
        return int(values["total_timesteps"])


def _read_tensors(path: Path, model: BaseAlgorithm) -> None:
    """Read networks, optimizers and single tensors; the zip's pickled part is never touched."""
    _, parameters, tensors = load_from_zip_file(path, device="cpu", load_data=False)
    model.set_parameters(parameters, device="cpu")
    for name in model._get_torch_save_params()[1]:
        with torch.no_grad():
            recursive_getattr(model, name).copy_((tensors or {})[name])


def _begin_new_episodes(model: BaseAlgorithm, venv: VecNormalize) -> None:
    """Let ``learn`` begin with a reset, to other starts than those of the part before."""
    model._last_obs = None
    venv.seed(training_seed(model.seed or 0, model.num_timesteps))
    if isinstance(model, OffPolicyAlgorithm):  # returns over several steps end here
        buffer: Any = model.replay_buffer
        last = buffer.pos - 1
        buffer.timeouts[last] = np.logical_or(buffer.timeouts[last], buffer.dones[last] == 0)


def _callback_state(callback: BaseCallback) -> dict[str, Any]:
    own = callback.state() if isinstance(callback, Resumable) else None
    return {"n_calls": callback.n_calls, "own": own}


def _require_format(values: Any, folder: Path) -> None:
    found = values.get("format", 1)
    if found != _FORMAT:
        raise RunFolderError(
            "format of a checkpoint",
            f"{found} ({folder})",
            f"{_FORMAT}, as this version writes",
            "Finish the run with the git revision that config.json names, or train anew.",
        )


@contextmanager
def _refused(folder: Path) -> Iterator[None]:
    try:
        yield
    except RunFolderError:
        raise
    except _DAMAGE as error:
        raise RunFolderError(
            "checkpoint", str(folder), "one written by this run", f"Cannot read it: {error}"
        ) from error
