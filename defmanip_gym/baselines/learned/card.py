"""What is known about an agent: how to run it, how it was made, how well it does; as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from defmanip_gym.envs.registration import ENV_IDS
from defmanip_gym.errors import AgentFileError
from defmanip_gym.theory.certificates import CERTIFICATE_METHODS
from defmanip_gym.theory.filters.family import STORAGE_FILTERS

CARD_FORMAT = 3
_READABLE = (2, CARD_FORMAT)  # 2 lacks what a later one has defaults for
ALGORITHMS = ("ppo", "sac", "tqc", "td3")
ACTIVATIONS = ("tanh", "relu")
_LARGEST_CARD_BYTES = 1_000_000


@dataclass(frozen=True, kw_only=True)
class Normalization:
    """How observations are normalized: clip((x − mean) / √(variance + floor), −clip, clip).

    Attributes:
        clip: largest magnitude of a normalized value.
        variance_floor: keeps constant observations finite.

    Raises:
        AgentFileError: a value out of range.
    """

    clip: float = 10.0
    variance_floor: float = 1e-8

    def __post_init__(self) -> None:
        for name in ("clip", "variance_floor"):
            value = getattr(self, name)
            _require(f"normalization.{name}", value, _is_number(value, 1e-12, 1e6), "a number > 0")


@dataclass(frozen=True, kw_only=True)
class SuiteScore:
    """What the evaluation measured of one agent on one suite.

    Attributes:
        success_rate: share of the episodes that reached the goal without exceeding σ.
        violation_rate: share that exceeded σ.
        score_iqm: interquartile mean of the episodes' scores.
        median_time_s: to the goal, over successful episodes; None without any.
        episodes: how many there were.

    Raises:
        AgentFileError: a value out of range.
    """

    success_rate: float
    violation_rate: float
    score_iqm: float
    median_time_s: float | None
    episodes: int

    def __post_init__(self) -> None:
        for name in ("success_rate", "violation_rate"):
            share = getattr(self, name)
            _require(f"scores.{name}", share, _is_number(share, 0.0, 1.0), "a share, 0 to 1")
        score, time = self.score_iqm, self.median_time_s
        _require("scores.score_iqm", score, _is_number(score, 0.0, 1e6), "a number >= 0")
        fits = time is None or _is_number(time, 0.0, 1e9)
        _require("scores.median_time_s", time, fits, "a number >= 0, or null")
        _require("scores.episodes", self.episodes, _is_whole(self.episodes, 1), "a whole number")

    @property
    def successes(self) -> int:
        """Number of successful episodes."""
        return round(self.success_rate * self.episodes)


@dataclass(frozen=True, kw_only=True)
class AgentCard:
    """Where an agent comes from and how to run it; stored as JSON beside its tensors.

    Attributes:
        env_id: environment it was trained on, one of ``ENV_IDS``.
        package_version: of defmanip_gym, and so of that environment.
        observation_size: length of its observations.
        action_size: length of its actions.
        activation: of the hidden layers.
        squashed: whether the output passes through tanh.
        normalization: of the observations; mean and variance are tensors.
        residual_authority_m_s2: None for a controller of its own; a number if the output, times
            this acceleration, is added to the command of another.
        residual_decision_periods: control periods that such an output is held for.
        residual_base: the registered controller that it is added to.
        algorithm: SB3's class name in lower case.
        recipe: name of the hyperparameter file.
        hyperparameters: as in that file.
        certificate: method of the certificate it was trained under, or None.
        safety_filter: name of the filter that knows the state which it was trained inside, or None.
        filter_specification: that filter's own, so that the agent can be run inside it again.
        command: the shell command that trained it.
        seed: of the training.
        total_timesteps: environment steps it was trained for.
        git_revision: of the working tree, or "unknown".
        sources: digest of the source files that the training depended on; None in old cards.
        scores: measured results by suite.
        format: version of this card.

    Raises:
        AgentFileError: a field of the wrong type or out of range.
    """

    env_id: str
    package_version: str
    observation_size: int
    action_size: int
    activation: Literal["tanh", "relu"]
    squashed: bool
    normalization: Normalization = field(default_factory=Normalization)
    residual_authority_m_s2: float | None = None
    residual_decision_periods: int = 1
    residual_base: str = "tanner"
    algorithm: str
    recipe: str
    hyperparameters: Mapping[str, Any]
    certificate: str | None = None
    safety_filter: str | None = None
    filter_specification: Mapping[str, Any] | None = None
    command: str
    seed: int
    total_timesteps: int
    git_revision: str
    sources: str | None = None
    scores: Mapping[str, SuiteScore] = field(default_factory=dict)
    format: int = CARD_FORMAT

    def __post_init__(self) -> None:
        _require("env_id", self.env_id, self.env_id in ENV_IDS, f"one of {', '.join(ENV_IDS)}")
        for name in ("package_version", "recipe", "command", "git_revision", "residual_base"):
            text = getattr(self, name)
            _require(name, text, isinstance(text, str) and text != "", "a text")
        for name, low in (
            ("observation_size", 1),
            ("action_size", 1),
            ("seed", 0),
            ("total_timesteps", 0),
            ("residual_decision_periods", 1),
        ):
            number = getattr(self, name)
            _require(name, number, _is_whole(number, low), f"a whole number >= {low}")
        _require_choice("activation", self.activation, ACTIVATIONS)
        _require_choice("algorithm", self.algorithm, ALGORITHMS)
        _require("squashed", self.squashed, isinstance(self.squashed, bool), "true or false")
        if self.certificate is not None:
            _require_choice("certificate", self.certificate, CERTIFICATE_METHODS)
        if self.safety_filter is not None:
            _require_choice("safety_filter", self.safety_filter, tuple(STORAGE_FILTERS))
            alone = self.certificate is None
            _require("safety_filter", self.safety_filter, alone, "null beside a certificate")
        for name in ("hyperparameters", "filter_specification"):
            content = getattr(self, name)
            fits = _is_json_object(content) or (content is None and name != "hyperparameters")
            _require(name, content, fits, "an object of JSON values")
        is_text = isinstance(self.sources, str) and self.sources != ""
        _require("sources", self.sources, self.sources is None or is_text, "a digest, or null")
        _require_instance("normalization", self.normalization, Normalization)
        for suite, score in self.scores.items():
            _require_instance(f"scores of {suite}", score, SuiteScore)
        if self.filter_specification is not None:
            told = self.filter_specification.get("name")
            fits = self.safety_filter is not None and told == self.safety_filter
            allowed = f"null, or that of safety_filter={self.safety_filter!r}"
            _require("filter_specification", self.filter_specification, fits, allowed)
        self._check_residual()

    def _check_residual(self) -> None:
        authority = self.residual_authority_m_s2
        fits = authority is None or (
            self.trained_inside is not None and _is_number(authority, 1e-9, 1e3)
        )
        allowed = "null, or m/s² > 0 of an agent trained inside a certificate or filter"
        _require("residual_authority_m_s2", authority, fits, allowed)

    @property
    def trained_inside(self) -> str | None:
        """Name of the certificate or filter that it was trained inside, or None."""
        return self.safety_filter if self.certificate is None else self.certificate

    def to_text(self) -> str:
        """Return the card as JSON."""
        return json.dumps(asdict(self), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def read_card(path: Path) -> AgentCard:
    """Return the card that ``to_text`` made.

    Raises:
        AgentFileError: the file is missing, damaged, or not a card of this format.
    """
    content = _parsed(read_small_file(path, "agent card (JSON)", _LARGEST_CARD_BYTES), path)
    if not isinstance(content, dict) or content.get("format") not in _READABLE:
        found = content.get("format") if isinstance(content, dict) else type(content).__name__
        newer = _is_whole(found, CARD_FORMAT + 1)
        remedy = "Upgrade defmanip_gym." if newer else "Train the agent again with train.py."
        raise AgentFileError("agent card format", found, " or ".join(map(str, _READABLE)), remedy)
    try:
        normalization = Normalization(**content.pop("normalization", {}))
        scores = {suite: SuiteScore(**row) for suite, row in content.pop("scores", {}).items()}
        return AgentCard(**content, normalization=normalization, scores=scores)
    except (TypeError, AttributeError) as error:
        known = ", ".join(field.name for field in fields(AgentCard))
        raise AgentFileError("agent card", str(path), f"the fields {known}", f"{error}.") from error


def read_small_file(path: Path, name: str, largest_bytes: int) -> bytes:
    """Return a file's content.

    Raises:
        AgentFileError: there is no such file, or it is larger than any agent's.
    """
    try:
        if path.exists() and not path.is_file():
            raise AgentFileError(name, str(path), "a file", "It is a folder or a device.")
        size = path.stat().st_size
        if size > largest_bytes:
            raise AgentFileError(
                name, f"{path} ({size} bytes)", f"at most {largest_bytes} bytes", "It is foreign."
            )
        return path.read_bytes()
    except FileNotFoundError as error:
        raise AgentFileError(
            name,
            str(path),
            "an existing file",
            "Tensors and card lie beside each other; train.py makes both.",
        ) from error
    except (OSError, ValueError) as error:
        if isinstance(error, AgentFileError):
            raise
        raise AgentFileError(name, str(path), "a file that can be read", f"{error}.") from error


def _parsed(content: bytes, path: Path) -> Any:
    try:
        return json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise AgentFileError("agent card", str(path), "JSON", f"It is damaged: {error}.") from error


def _require(name: str, value: object, fits: bool, allowed: str) -> None:
    if not fits:
        raise AgentFileError(name, value, allowed, "The agent's card is damaged or foreign.")


def _require_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    _require(name, value, isinstance(value, str) and value in choices, ", ".join(choices))


def _require_instance(name: str, value: object, kind: type) -> None:
    _require(name, value, isinstance(value, kind), f"a {kind.__name__}")


def _is_whole(value: object, low: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= low


def _is_number(value: object, low: float, high: float) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return low <= value <= high  # false of NaN


def _is_json_object(value: object) -> bool:
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError, RecursionError):
        return False
    return isinstance(value, dict)
