"""Hyperparameters in rl-zoo3's YAML format, as ``rl_zoo3 train --conf-file`` takes them."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml

from defmanip_gym.errors import DefmanipError, ParameterError

HYPERPARAMETERS = Path(__file__).parents[1] / "baselines" / "learned" / "hyperparams"

# entries that describe environment and run, not the algorithm's constructor
NOT_FOR_THE_ALGORITHM = frozenset(
    {
        "n_envs",
        "n_timesteps",
        "normalize",
        "noise_type",
        "noise_std",
        "env_kwargs",
        "env_wrapper",
        "callback",
    }
)


def load_hyperparameters(path: Path | None, algo: str, env_id: str) -> dict[str, Any]:
    """Return the hyperparameters for an environment in a YAML file, the package's by default.

    Raises:
        ParameterError: the file is missing, not YAML, or has no entry for the environment.
    """
    path = path or HYPERPARAMETERS / f"{algo}.yml"
    try:
        content = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ParameterError(
            "hyperparameters", str(path), "a readable YAML file", f"{error}"
        ) from error
    if not isinstance(content, dict) or not isinstance(content.get(env_id), dict):
        raise ParameterError(
            "hyperparameters", str(path), f"a mapping with the key {env_id}", "See the package's."
        )
    return checked_hyperparameters(content[env_id], str(path))


def checked_hyperparameters(hyperparameters: Any, source: str) -> dict[str, Any]:
    """Return hyperparameters that have what training needs besides the algorithm's own.

    Raises:
        ParameterError: an entry is missing, or is one that training would not follow.
    """
    if not isinstance(hyperparameters, dict):
        raise ParameterError("hyperparameters", hyperparameters, "a mapping", f"Check {source}.")
    missing = {"n_envs", "n_timesteps", "policy", "learning_rate"} - set(hyperparameters)
    if missing:
        raise ParameterError(
            "hyperparameters",
            source,
            "n_envs, n_timesteps, policy, learning_rate and the algorithm's own",
            f"It lacks {', '.join(sorted(missing))}.",
        )
    steps, normalize = hyperparameters["n_timesteps"], hyperparameters.get("normalize")
    if isinstance(steps, bool) or not isinstance(steps, int | float) or not 1 <= steps < math.inf:
        raise ParameterError("n_timesteps", steps, "a number >= 1", f"Check {source}.")
    if normalize is not True:
        raise ParameterError(
            "normalize", normalize, "true", "Training always normalizes: write it so."
        )
    gamma = hyperparameters.get("gamma", 1.0)
    if isinstance(gamma, bool) or not isinstance(gamma, int | float) or not 0 < gamma <= 1:
        raise ParameterError("gamma", gamma, "a number, 0 < gamma <= 1", f"Check {source}.")
    return dict(hyperparameters)


def components(hyperparameters: dict[str, Any], key: str) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Yield the classes that an entry such as ``env_wrapper`` names, with their arguments.

    The entry is a dotted path, ``{path: arguments}``, or a list of these.

    Raises:
        ParameterError: an entry of another form, or a path that leads nowhere.
    """
    entries = hyperparameters.get(key) or []
    for entry in entries if isinstance(entries, list) else [entries]:
        path, arguments = (entry, {}) if isinstance(entry, str) else _only_item(entry, key)
        module, _, name = path.rpartition(".")
        try:
            yield getattr(importlib.import_module(module), name), arguments
        except (ImportError, AttributeError, TypeError, ValueError) as error:
            raise ParameterError(
                key, path, "the dotted path of a class", f"It cannot be imported: {error}."
            ) from error


def built(key: str, kind: Callable[..., Any], base: tuple[Any, ...], arguments: Any) -> Any:
    """Return ``kind(*base, **arguments)``, the arguments being those of the entry ``key``.

    Raises:
        ParameterError: arguments that ``kind`` does not take.
    """
    try:
        return kind(*base, **arguments)
    except DefmanipError:
        raise
    except (TypeError, ValueError) as error:
        name = getattr(kind, "__name__", str(kind))
        raise ParameterError(key, arguments, f"arguments of {name}", f"{error}.") from error


def _only_item(entry: Any, key: str) -> tuple[str, dict[str, Any]]:
    if isinstance(entry, dict) and len(entry) == 1:
        path, arguments = next(iter(entry.items()))
        if isinstance(path, str) and isinstance(arguments or {}, dict):
            return path, arguments or {}
    raise ParameterError(
        key, entry, "a dotted path or {path: {argument: value}}", "Check the indentation."
    )
