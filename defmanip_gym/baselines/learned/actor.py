"""A trained policy as plain tensors: safetensors plus a JSON card, run in NumPy.

Nothing is unpickled, and neither torch nor SB3 is needed to run it. Every SB3 actor over a flat
observation (PPO's mean, SAC's, TQC's and TD3's actor) is observation normalization followed by a
multilayer perceptron.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from defmanip_gym.baselines.controller import State
from defmanip_gym.baselines.learned.card import AgentCard, read_card, read_small_file
from defmanip_gym.errors import AgentFileError
from defmanip_gym.files import write_atomically

Array = NDArray[np.float64]

CARD_SUFFIX, TENSOR_SUFFIX = ".json", ".safetensors"


def _relu(x: Array) -> Array:
    return np.maximum(x, 0.0)


_ACTIVATIONS: dict[str, Callable[[Array], Array]] = {"tanh": np.tanh, "relu": _relu}
_LATER_FIELDS = ("residual_base", "filter_specification", "sources")
# Beyond what any training makes; within them no sum of the network overflows.
_LARGEST_TENSOR_BYTES = 64 * 2**20
_LARGEST_WEIGHT = 1e9
_MOST_LAYERS = 16


class MlpActor:
    """A deterministic policy network over normalized observations.

    Args:
        card: how to run it.
        weights: (out, in) of each layer.
        biases: (out,) of each layer.
        observation_mean: (size,).
        observation_variance: (size,).
    """

    def __init__(
        self,
        card: AgentCard,
        *,
        weights: list[Array],
        biases: list[Array],
        observation_mean: Array,
        observation_variance: Array,
    ) -> None:
        self.card = card
        self._weights, self._biases = weights, biases
        self._mean, self._variance = observation_mean, observation_variance
        self._activation = _ACTIVATIONS[card.activation]

    @cached_property
    def _scale(self) -> Array:
        return 1.0 / np.sqrt(self._variance + self.card.normalization.variance_floor)

    @property
    def digest(self) -> str:
        """Eight hexadecimal digits that tell this agent from every other, whatever its scores."""
        card = asdict(self.card) | {"scores": {}}
        for name in _LATER_FIELDS:  # cards from before them keep their digests
            if card[name] == getattr(AgentCard, name):
                del card[name]
        content = hashlib.sha256(json.dumps(card, sort_keys=True).encode())
        for array in (self._mean, self._variance, *self._weights, *self._biases):
            content.update(np.ascontiguousarray(array, dtype=np.float64).tobytes())
        return content.hexdigest()[:8]

    @property
    def observation_size(self) -> int:
        """Length of the observations it takes."""
        return self.card.observation_size

    @property
    def observation_mean(self) -> Array:
        """What is subtracted from observations, (size,)."""
        return self._mean

    @property
    def observation_variance(self) -> Array:
        """Whose root, with the card's floor under it, they are divided by, (size,)."""
        return self._variance

    @property
    def layers(self) -> tuple[tuple[Array, Array], ...]:
        """Weight (out, in) and bias (out,) of each layer."""
        return tuple(zip(self._weights, self._biases, strict=True))

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return the mean action, clipped to [-1, 1].

        Raises:
            AgentFileError: observations of another length than it was trained on.
        """
        if observation.shape[-1] != self.card.observation_size:
            raise AgentFileError(
                "observation size",
                observation.shape[-1],
                f"{self.card.observation_size}, as in training",
                "Use an agent trained on a beam with as many segments.",
            )
        limit = self.card.normalization.clip
        x = np.clip((observation - self._mean) * self._scale, -limit, limit)
        last = len(self._weights) - 1
        for index, (weight, bias) in enumerate(zip(self._weights, self._biases, strict=True)):
            # a sum per row in a fixed order, so that an action does not depend on the batch
            x = np.einsum("...i,oi->...o", x, weight) + bias
            if index < last:
                x = self._activation(x)
        return (np.tanh(x) if self.card.squashed else np.clip(x, -1.0, 1.0)), state

    def save(self, stem: Path) -> None:
        """Write ``stem``.safetensors and ``stem``.json."""
        tensors: dict[str, NDArray[Any]] = {
            "observation.mean": self._mean,
            "observation.variance": self._variance,
        }
        for index, (weight, bias) in enumerate(zip(self._weights, self._biases, strict=True)):
            tensors[f"layers.{index}.weight"] = weight.astype(np.float32)
            tensors[f"layers.{index}.bias"] = bias.astype(np.float32)
        write_atomically(tensor_path(stem), save(tensors))
        write_atomically(card_path(stem), self.card.to_text().encode())


def tensor_path(stem: Path) -> Path:
    """Return the path of an agent's tensors."""
    return stem.with_name(stem.name + TENSOR_SUFFIX)  # with_suffix would cut "run-1.5" short


def card_path(stem: Path) -> Path:
    """Return the path of an agent's card."""
    return stem.with_name(stem.name + CARD_SUFFIX)


def load_actor(stem: Path) -> MlpActor:
    """Load an agent from ``stem``.safetensors and ``stem``.json.

    Raises:
        AgentFileError: a file is missing, damaged or not an agent of this package.
    """
    card = read_card(card_path(stem))
    path = tensor_path(stem)
    try:
        tensors = load(read_small_file(path, "agent", _LARGEST_TENSOR_BYTES))
    except (SafetensorError, KeyError, TypeError) as error:
        raise _foreign(path, f"It is damaged: {error}.") from error
    count = sum(name.endswith(".weight") for name in tensors)
    names = [f"layers.{index}.{kind}" for index in range(count) for kind in ("weight", "bias")]
    if {*names, "observation.mean", "observation.variance"} != set(tensors):
        raise _foreign(path, f"Its tensors are {', '.join(sorted(tensors))[:200]}.")
    if any(tensor.dtype.kind != "f" for tensor in tensors.values()):
        raise _foreign(path, "Some tensors are not of real numbers.")
    arrays = {name: tensor.astype(np.float64) for name, tensor in tensors.items()}
    actor = MlpActor(
        card,
        weights=[arrays[f"layers.{index}.weight"] for index in range(count)],
        biases=[arrays[f"layers.{index}.bias"] for index in range(count)],
        observation_mean=arrays["observation.mean"],
        observation_variance=arrays["observation.variance"],
    )
    _check_tensors(actor, path)
    return actor


def _check_tensors(actor: MlpActor, path: Path) -> None:
    """Raise AgentFileError unless the layers lead from observations to actions, all finite."""
    size = actor.card.observation_size
    arrays = [actor._mean, actor._variance, *actor._weights, *actor._biases]
    widths = [size, *(len(bias) for bias in actor._biases if bias.ndim == 1)]
    expected = list(zip(widths[1:], widths[:-1], strict=True))
    if (
        not 0 < len(actor._weights) <= _MOST_LAYERS
        or [weight.shape for weight in actor._weights] != expected
        or widths[-1] != actor.card.action_size
        or not actor._mean.shape == actor._variance.shape == (size,)
    ):
        raise _foreign(
            path,
            f"The card tells of {size} observations and {actor.card.action_size} actions, the "
            f"layers have {[weight.shape for weight in actor._weights]}.",
        )
    if not all((np.abs(array) <= _LARGEST_WEIGHT).all() for array in arrays):  # nor NaN
        raise _foreign(path, f"Some values are not finite or beyond {_LARGEST_WEIGHT:g}.")
    if (actor._variance < 0).any():
        raise _foreign(path, "Some variances are negative.")


def _foreign(path: Path, remedy: str) -> AgentFileError:
    return AgentFileError(
        "agent", str(path), "finite layers of matching sizes, written by this package", remedy
    )
