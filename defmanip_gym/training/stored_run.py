"""How a run was started, as its folder's ``config.json`` tells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from defmanip_gym.errors import ParameterError
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.hyperparameters import checked_hyperparameters
from defmanip_gym.validation import require_instance


@dataclass(frozen=True, kw_only=True)
class StoredRun:
    """How a run was started.

    Attributes:
        train: its options; those that name other files are left out.
        hyperparameters: as they were in the file.
        command: the shell command.
        package_version: of this package.
        git_revision: of the sources, or "unknown".
        sources: digest of the files that it depends on.
    """

    train: TrainConfig
    hyperparameters: dict[str, Any]
    command: str
    package_version: str
    git_revision: str
    sources: str

    @staticmethod
    def checked(content: Any, source: str) -> StoredRun:
        """Return what the content of the JSON file ``source`` says.

        Raises:
            ParameterError: an entry is missing, unknown, or out of range.
        """
        _require_keys("config.json", content, StoredRun)
        for name in ("command", "package_version", "git_revision", "sources"):
            require_instance(name, content[name], str)
        train = content["train"]
        if isinstance(train, Mapping):
            train = {"filter": None, **train}  # runs that began before there were filters
        _require_keys("train", train, TrainConfig)
        require_instance("output", train["output"], str)
        elsewhere = {"output": Path(train["output"]), "resume": None, "hyperparameters": None}
        return StoredRun(
            train=TrainConfig(**(train | elsewhere)),
            hyperparameters=checked_hyperparameters(content["hyperparameters"], source),
            command=content["command"],
            package_version=content["package_version"],
            git_revision=content["git_revision"],
            sources=content["sources"],
        )


def _require_keys(name: str, content: Any, kind: type[StoredRun | TrainConfig]) -> None:
    expected = {field.name for field in fields(kind)}
    if not isinstance(content, Mapping) or set(content) != expected:
        raise ParameterError(name, content, f"a mapping with {sorted(expected)}", "It is damaged.")
