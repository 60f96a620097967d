"""What an SB3 algorithm's future depends on, beside its tensors and the generators."""

from __future__ import annotations

from collections import deque
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

# attributes of plain values: counters, and the observations that the next actions answer
_ATTRIBUTES = (
    "num_timesteps",
    "_n_updates",
    "_episode_num",
    "_current_progress_remaining",
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
)
_RECENT = ("ep_info_buffer", "ep_success_buffer")
_LOGGED = ("name_to_value", "name_to_count", "name_to_excluded")
_REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
_MOMENTS = ("mean", "var", "count")


def learner_state(model: BaseAlgorithm) -> dict[str, Any]:
    """Return counters, last observations, recent episodes, logged values and replay buffer."""
    logger: Any = model.logger
    state = {
        "attributes": {name: getattr(model, name) for name in _ATTRIBUTES},
        "recent": {name: list(getattr(model, name)) for name in _RECENT},
        # values stay with the logger until its next row
        "logged": {name: dict(getattr(logger, name)) for name in _LOGGED},
    }
    if isinstance(model, OffPolicyAlgorithm):
        buffer: Any = model.replay_buffer
        # one row more, as some buffers keep the next observation there
        filled = buffer.size() + 1
        state["replay"] = {"pos": buffer.pos, "full": bool(buffer.full)} | {
            name: getattr(buffer, name)[:filled] for name in _REPLAY if hasattr(buffer, name)
        }
    return state


def set_learner_state(model: BaseAlgorithm, state: dict[str, Any]) -> None:
    """Go on from what ``learner_state`` returned."""
    for name in _ATTRIBUTES:
        setattr(model, name, state["attributes"][name])
    for name in _RECENT:
        setattr(model, name, deque(state["recent"][name], maxlen=model._stats_window_size))
    for name in _LOGGED:
        getattr(model.logger, name).update(state["logged"][name])
    if isinstance(model, OffPolicyAlgorithm):
        buffer: Any = model.replay_buffer
        kept = dict(state["replay"])
        buffer.pos, buffer.full = kept.pop("pos"), kept.pop("full")
        for name, rows in kept.items():
            getattr(buffer, name)[: len(rows)] = rows


def normalization_state(venv: VecNormalize) -> dict[str, Any]:
    """Return the running statistics of observations and returns, and the running returns."""
    statistics = {"obs_rms": observation_statistics(venv), "ret_rms": venv.ret_rms}
    return {"returns": venv.returns} | {
        name: {moment: getattr(one, moment) for moment in _MOMENTS}
        for name, one in statistics.items()
    }


def set_normalization_state(venv: VecNormalize, state: dict[str, Any]) -> None:
    """Go on from what ``normalization_state`` returned."""
    venv.returns = state["returns"]
    for name in ("obs_rms", "ret_rms"):
        for moment in _MOMENTS:
            setattr(getattr(venv, name), moment, state[name][moment])


def observation_statistics(venv: VecNormalize) -> RunningMeanStd:
    """Return the running statistics of a flat observation."""
    statistics = venv.obs_rms
    assert isinstance(statistics, RunningMeanStd)  # a dict only for dict observations
    return statistics
