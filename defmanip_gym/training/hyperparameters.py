"""Hyperparameters in rl-zoo3's YAML format, as ``rl_zoo3 train --conf-file`` takes them."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from defmanip_gym.errors import ParameterError

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


def checked_hyperparameters(hyperparameters: dict[str, Any], source: str) -> dict[str, Any]:
    """Return hyperparameters that have what training needs.

    Raises:
        ParameterError: an entry is missing.
    """
    missing = {"n_envs", "n_timesteps", "policy", "learning_rate"} - set(hyperparameters)
    if missing:
        raise ParameterError(
            "hyperparameters",
            source,
            "n_envs, n_timesteps, policy, learning_rate and the algorithm's own",
            f"It lacks {', '.join(sorted(missing))}.",
        )
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
        except (ImportError, AttributeError, ValueError) as error:
            raise ParameterError(
                key, path, "the dotted path of a class", f"It cannot be imported: {error}."
            ) from error


def _only_item(entry: Any, key: str) -> tuple[str, dict[str, Any]]:
    if isinstance(entry, dict) and len(entry) == 1:
        path, arguments = next(iter(entry.items()))
        if isinstance(path, str) and isinstance(arguments or {}, dict):
            return path, arguments or {}
    raise ParameterError(
        key, entry, "a dotted path or {path: {argument: value}}", "Check the indentation."
    )
