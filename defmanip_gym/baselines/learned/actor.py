"""A trained policy as plain tensors: safetensors plus a JSON card, run in NumPy.

Nothing is unpickled, and neither torch nor SB3 is needed to run it. Every SB3 actor over a flat
observation (PPO's mean, SAC's and TD3's actor) is observation normalization followed by a
multilayer perceptron.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file, save

from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import AgentFileError
from defmanip_gym.files import write_atomically

Array = NDArray[np.float64]

CARD_FORMAT = 1
CARD_SUFFIX, TENSOR_SUFFIX = ".json", ".safetensors"
_NORMALIZED_LIMIT = 10.0  # VecNormalize's clip_obs
_VARIANCE_FLOOR = 1e-8
_ACTIVATIONS: dict[str, Callable[[Array], Array]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
}


@dataclass(frozen=True, kw_only=True)
class AgentCard:
    """Where an agent comes from and how to run it; stored as JSON beside its tensors.

    Attributes:
        env_id: environment it was trained on.
        observation_size: length of its observations.
        action_size: length of its actions.
        algorithm: name of the learning algorithm.
        activation: of the hidden layers.
        squashed: whether the output passes through tanh.
        command: the shell command that trained it.
        seed: of the training.
        total_timesteps: environment steps it was trained for.
        package_version: of defmanip_gym.
        git_revision: of the working tree, or "unknown".
        certificate: method of the certificate it was trained under, or None.
        scores: measured results by name.
        format: version of this card.
    """

    env_id: str
    observation_size: int
    action_size: int
    algorithm: str
    activation: Literal["tanh", "relu"]
    squashed: bool
    command: str
    seed: int
    total_timesteps: int
    package_version: str
    git_revision: str
    certificate: str | None = None
    scores: dict[str, float] = field(default_factory=dict)
    format: int = CARD_FORMAT


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
        return 1.0 / np.sqrt(self._variance + _VARIANCE_FLOOR)

    @property
    def digest(self) -> str:
        """Eight hexadecimal digits that tell this agent from every other."""
        content = hashlib.sha256(json.dumps(asdict(self.card), sort_keys=True).encode())
        for array in (self._mean, self._variance, *self._weights, *self._biases):
            content.update(np.ascontiguousarray(array, dtype=np.float64).tobytes())
        return content.hexdigest()[:8]

    @property
    def observation_size(self) -> int:
        """Length of the observations it takes."""
        return self.card.observation_size

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
        x = np.clip((observation - self._mean) * self._scale, -_NORMALIZED_LIMIT, _NORMALIZED_LIMIT)
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
        write_atomically(stem.with_suffix(TENSOR_SUFFIX), save(tensors))
        text = json.dumps(asdict(self.card), indent=2) + "\n"
        write_atomically(stem.with_suffix(CARD_SUFFIX), text.encode())


def load_actor(stem: Path) -> MlpActor:
    """Load an agent from ``stem``.safetensors and ``stem``.json.

    Raises:
        AgentFileError: a file is missing, damaged or not an agent of this package.
    """
    card = _load_card(stem.with_suffix(CARD_SUFFIX))
    path = stem.with_suffix(TENSOR_SUFFIX)
    try:
        tensors = load_file(path)
        count = sum(name.endswith(".weight") for name in tensors)
        actor = MlpActor(
            card,
            weights=[tensors[f"layers.{i}.weight"].astype(np.float64) for i in range(count)],
            biases=[tensors[f"layers.{i}.bias"].astype(np.float64) for i in range(count)],
            observation_mean=tensors["observation.mean"],
            observation_variance=tensors["observation.variance"],
        )
    except FileNotFoundError as error:
        raise AgentFileError(
            "agent", str(path), "an existing file", "Train one with train.py."
        ) from error
    except (SafetensorError, KeyError, OSError, ValueError) as error:
        raise AgentFileError(
            "agent", str(path), "tensors written by this package", f"It is damaged: {error}"
        ) from error
    _check_shapes(actor, path)
    return actor


def _check_shapes(actor: MlpActor, path: Path) -> None:
    """Raise AgentFileError unless the layers lead from observations to actions, all finite."""
    size = actor.card.observation_size
    arrays = [actor._mean, actor._variance, *actor._weights, *actor._biases]
    widths = [size, *(len(bias) for bias in actor._biases if bias.ndim == 1)]
    expected = list(zip(widths[1:], widths[:-1], strict=True))
    fits = (
        len(actor._weights) > 0
        and [weight.shape for weight in actor._weights] == expected
        and widths[-1] == actor.card.action_size
        and actor._mean.shape == actor._variance.shape == (size,)
    )
    if not fits or not all(np.isfinite(array).all() for array in arrays):
        raise AgentFileError(
            "agent", str(path), "finite layers of matching sizes", "It is damaged or foreign."
        )
    if (actor._variance < 0).any():
        raise AgentFileError("agent", str(path), "variances >= 0", "It is damaged or foreign.")


def _load_card(path: Path) -> AgentCard:
    try:
        fields = json.loads(path.read_text())
    except FileNotFoundError as error:
        raise AgentFileError(
            "agent card", str(path), "an existing JSON file", "Keep it beside the tensors."
        ) from error
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise AgentFileError("agent card", str(path), "a JSON card", f"{error}") from error
    if not isinstance(fields, dict) or fields.get("format") != CARD_FORMAT:
        raise AgentFileError(
            "agent card format",
            fields.get("format") if isinstance(fields, dict) else fields,
            str(CARD_FORMAT),
            "It was written by another version or program.",
        )
    try:
        card = AgentCard(**fields)
    except TypeError as error:
        raise AgentFileError("agent card", str(path), "the card's fields", f"{error}") from error
    for name, kind in (("observation_size", int), ("action_size", int), ("activation", str)):
        if type(getattr(card, name)) is not kind:
            raise AgentFileError(name, getattr(card, name), kind.__name__, "Check the card.")
    if card.env_id != ENV_ID:
        raise AgentFileError(
            "env_id", card.env_id, ENV_ID, "It was trained on another environment."
        )
    if card.activation not in _ACTIVATIONS:
        raise AgentFileError("activation", card.activation, "'tanh' or 'relu'", "Check the card.")
    return card
