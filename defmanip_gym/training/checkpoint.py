"""Everything a run needs to go on, written and read without pickle."""

from __future__ import annotations

import json
import pickle
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.errors import RunFolderError
from defmanip_gym.training.callbacks import Resumable

_MODEL, _NORMALIZATION, _STATE, _REPLAY = (
    "model.zip",
    "normalization.npz",
    "state.json",
    "replay.npz",
)
_REPLAY_FIELDS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
# what a cut, edited or foreign file makes NumPy, torch and zipfile raise
_DAMAGE = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    KeyError,
    RuntimeError,
    zipfile.BadZipFile,
    pickle.UnpicklingError,
)


def observation_statistics(venv: VecNormalize) -> RunningMeanStd:
    """Return the running statistics of a flat observation."""
    statistics = venv.obs_rms
    assert isinstance(statistics, RunningMeanStd)  # a dict only for dict observations
    return statistics


def write_checkpoint(
    folder: Path, model: BaseAlgorithm, venv: VecNormalize, callbacks: Sequence[Resumable] = ()
) -> None:
    """Write networks, optimizers, normalization, counters, callbacks and the replay buffer."""
    model.save(folder / _MODEL)
    observation = observation_statistics(venv)
    np.savez(
        folder / _NORMALIZATION,
        obs_mean=observation.mean,
        obs_var=observation.var,
        obs_count=observation.count,
        ret_mean=venv.ret_rms.mean,
        ret_var=venv.ret_rms.var,
        ret_count=venv.ret_rms.count,
    )
    state: dict[str, Any] = {
        "num_timesteps": model.num_timesteps,
        "n_updates": model._n_updates,
        "callbacks": [callback.state() for callback in callbacks],
    }
    if isinstance(model, OffPolicyAlgorithm):
        buffer: Any = model.replay_buffer
        filled = buffer.buffer_size if buffer.full else buffer.pos
        arrays = {name: getattr(buffer, name)[:filled] for name in _REPLAY_FIELDS}
        np.savez(folder / _REPLAY, **arrays)
        state |= {"replay_pos": buffer.pos, "replay_full": bool(buffer.full)}
    (folder / _STATE).write_text(json.dumps(state))


def read_checkpoint(
    folder: Path, model: BaseAlgorithm, venv: VecNormalize, callbacks: Sequence[Resumable] = ()
) -> None:
    """Put a checkpoint into a model and normalization built from the same configuration.

    Raises:
        RunFolderError: the checkpoint is damaged or of another shape.
    """
    try:
        # set_parameters reads tensors only; the zip's pickled part is never touched
        model.set_parameters(folder / _MODEL, device="cpu")  # type: ignore[arg-type]
        with np.load(folder / _NORMALIZATION, allow_pickle=False) as arrays:
            for prefix, statistics in (
                ("obs", observation_statistics(venv)),
                ("ret", venv.ret_rms),
            ):
                statistics.mean = arrays[f"{prefix}_mean"]
                statistics.var = arrays[f"{prefix}_var"]
                statistics.count = float(arrays[f"{prefix}_count"])
        state = json.loads((folder / _STATE).read_text())
        model.num_timesteps = int(state["num_timesteps"])
        model._n_updates = int(state["n_updates"])
        for callback, numbers in zip(callbacks, state["callbacks"], strict=True):
            callback.set_state(numbers)
        if isinstance(model, OffPolicyAlgorithm):
            buffer: Any = model.replay_buffer
            with np.load(folder / _REPLAY, allow_pickle=False) as arrays:
                for name in _REPLAY_FIELDS:
                    getattr(buffer, name)[: len(arrays[name])] = arrays[name]
            buffer.pos, buffer.full = int(state["replay_pos"]), bool(state["replay_full"])
            # new episodes follow: returns over several steps must not reach into them
            last = buffer.pos - 1
            buffer.timeouts[last] = np.logical_or(buffer.timeouts[last], buffer.dones[last] == 0)
    except _DAMAGE as error:
        raise RunFolderError(
            "checkpoint", str(folder), "one written by this run", f"Cannot read it: {error}"
        ) from error
