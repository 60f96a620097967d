"""Simulating a dataset's actions again, and comparing bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import DatasetError

_OWN = "defmanip_gym."


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Where an episode and its repetition part.

    Attributes:
        episode: number in the dataset.
        what: observations, rewards, ...; "steps" where one goes on longer.
        step: the first that differs; observation k is the one before action k.
        stored: in the dataset.
        again: now.
    """

    episode: int
    what: str
    step: int
    stored: str
    again: str

    def __str__(self) -> str:
        return (
            f"episode {self.episode}, step {self.step}, {self.what}: "
            f"stored {self.stored}, again {self.again}"
        )


def differences(dataset: Any) -> Iterator[tuple[Difference, ...]]:
    """Yield the differences of each episode, the first one of each kind.

    Args:
        dataset: Minari's.

    Raises:
        DatasetError: it is no dataset of this package's environments, or an episode lacks a seed
            or its costs.
    """
    env = _environment(dataset)
    try:
        numbers = [int(number) for number in dataset.episode_indices]
        seeds = dataset.storage.get_episode_metadata(numbers)
        episodes = dataset.iterate_episodes(numbers)
        for number, metadata, episode in zip(numbers, seeds, episodes, strict=True):
            stored, seed = _stored(episode), metadata.get("seed")
            if stored is None or seed is None:
                raise DatasetError(
                    f"episode {number}",
                    sorted(metadata),
                    "an episode with its seed, and its costs in infos",
                    "Datasets of defmanip dataset have both.",
                )
            again = _again(env, seed, episode.actions)
            yield tuple(_parted(number, stored, again))
    except (OSError, KeyError) as error:  # h5py's
        raise DatasetError("dataset", str(error), "a file that can be read", "Damaged?") from error
    finally:
        env.close()


def _environment(dataset: Any) -> gymnasium.Env[Any, Any]:
    """Return the dataset's environment; others' are not made, as that runs code of others."""
    spec = dataset.env_spec
    entry_point = getattr(spec, "entry_point", None)
    if not str(entry_point).startswith(_OWN) or spec.additional_wrappers:
        raise DatasetError(
            "environment of the dataset",
            entry_point,
            "one of this package, without wrappers",
            "Others' datasets have their own ways to be repeated.",
        )
    env: gymnasium.Env[Any, Any] = dataset.recover_environment(disable_env_checker=True)
    return env


def _stored(episode: Any) -> dict[str, NDArray[Any]] | None:
    infos = episode.infos or {}
    if "cost" not in infos:
        return None
    return {
        "observations": episode.observations,
        "rewards": episode.rewards,
        "costs": infos["cost"],
        "terminations": episode.terminations,
        "truncations": episode.truncations,
    }


def _again(
    env: gymnasium.Env[Any, Any], seed: int, actions: NDArray[Any]
) -> dict[str, NDArray[Any]]:
    """Return the same of an episode from this seed with these actions, until it ends."""
    observation, info = env.reset(seed=seed)
    observations, costs = [observation], [info["cost"]]
    rewards, terminations, truncations = [], [], []
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        costs.append(info["cost"])
        rewards.append(reward)
        terminations.append(terminated)
        truncations.append(truncated and not terminated)  # Gymnasium's TimeLimit says both
        if terminated or truncated:
            break
    return {
        "observations": np.array(observations),
        "rewards": np.array(rewards),
        "costs": np.array(costs),
        "terminations": np.array(terminations),
        "truncations": np.array(truncations),
    }


def _parted(
    number: int, stored: dict[str, NDArray[Any]], again: dict[str, NDArray[Any]]
) -> Iterator[Difference]:
    lengths = len(stored["rewards"]), len(again["rewards"])
    if lengths[0] != lengths[1]:
        yield Difference(
            episode=number,
            what="steps",
            step=min(lengths),
            stored=str(lengths[0]),
            again=str(lengths[1]),
        )
    for what, old in stored.items():
        new = again[what]
        step = _first_difference(old, new)
        if step is not None:
            before, now = (str(values[step]) for values in (old, new))
            yield Difference(episode=number, what=what, step=step, stored=before, again=now)


def _first_difference(old: NDArray[Any], new: NDArray[Any]) -> int | None:
    """Return the first row, as far as both go, whose bits or kind of numbers differ."""
    count = min(len(old), len(new))
    if not count or (old.dtype, old.shape[1:]) != (new.dtype, new.shape[1:]):
        return 0
    rows = [np.ascontiguousarray(values[:count]).view(np.uint8) for values in (old, new)]
    differs = (rows[0] != rows[1]).reshape(count, -1).any(axis=1)
    return int(np.argmax(differs)) if differs.any() else None
