"""A training run on disk: configuration, checkpoints, curves, exported agents."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from defmanip_gym.errors import RunFolderError
from defmanip_gym.files import write_atomically
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.sources import sources_digest
from defmanip_gym.training.stored_run import StoredRun
from defmanip_gym.version import __version__, git_revision

LAST_AGENT = "last"  # beside RUN_AGENT, the best on the validation starts

_CONFIG = "config.json"
_LOCK = ".lock"
_CHECKPOINTS = "checkpoints"
_KEPT_CHECKPOINTS = 2


class RunFolder:
    """Paths and atomic writes of one run.

    Args:
        path: the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @staticmethod
    def named(config: TrainConfig) -> RunFolder:
        """Return the folder that a run has by its name, whether it is there or not."""
        inside = f"-{config.trained_inside}" if config.trained_inside else ""
        name = f"{config.env_id}-{config.algo}{inside}-seed{config.seed}"
        return RunFolder(config.output / name)

    @staticmethod
    def create(config: TrainConfig, hyperparameters: dict[str, Any], command: str) -> RunFolder:
        """Make a folder whose name tells algorithm and seed, with its configuration inside.

        Raises:
            RunFolderError: the output folder cannot be written.
        """
        try:
            config.output.mkdir(parents=True, exist_ok=True)
            temporary = Path(tempfile.mkdtemp(dir=config.output, prefix=".creating-"))
            temporary.chmod(0o755)
            RunFolder(temporary)._write_config(config, hyperparameters, command)
            folder = RunFolder(_first_free(RunFolder.named(config).path))
            os.rename(temporary, folder.path)
        except OSError as error:
            raise RunFolderError(
                "output", str(config.output), "a writable folder", f"{error}"
            ) from error
        return folder

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep others from training or deleting the run.

        Raises:
            RunFolderError: somebody else does, or the folder cannot be written.
        """
        lock = FileLock(self.path / _LOCK)
        try:
            lock.acquire(timeout=0)
        except Timeout as error:
            raise RunFolderError(
                "run", str(self.path), "one that nobody trains", "Wait until it ends, or end it."
            ) from error
        except OSError as error:
            raise RunFolderError("run", str(self.path), "a writable folder", f"{error}.") from error
        try:
            yield
        finally:
            lock.release()

    def _write_config(
        self, config: TrainConfig, hyperparameters: dict[str, Any], command: str
    ) -> None:
        content = {
            "train": {key: _plain(value) for key, value in asdict(config).items()},
            "hyperparameters": hyperparameters,
            "command": command,
            "package_version": __version__,
            "git_revision": git_revision(),
            "sources": sources_digest(),
        }
        write_atomically(self.path / _CONFIG, (json.dumps(content, indent=2) + "\n").encode())

    def read_config(self) -> StoredRun:
        """Return what ``create`` wrote.

        Raises:
            RunFolderError: this is no run folder of this package, or its configuration is damaged.
        """
        path = self.path / _CONFIG
        try:
            return StoredRun.checked(json.loads(path.read_text()), str(path))
        except (OSError, ValueError) as error:  # ParameterError and JSON's are ValueErrors
            raise RunFolderError(
                "run", str(self.path), "a folder made by train.py", f"{_CONFIG}: {error}"
            ) from error

    def save_checkpoint(self, timesteps: int, write: Callable[[Path], None]) -> Path:
        """Let ``write`` fill a folder that appears under its name only when complete."""
        parent = self.path / _CHECKPOINTS
        parent.mkdir(exist_ok=True)
        target = parent / f"step-{timesteps:010d}"
        temporary = Path(tempfile.mkdtemp(dir=parent, prefix=".writing-"))
        try:
            write(temporary)
            if target.exists():
                shutil.rmtree(target)
            os.rename(temporary, target)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise
        for old in self._checkpoints()[:-_KEPT_CHECKPOINTS]:
            shutil.rmtree(old)
        return target

    def last_checkpoint(self) -> Path:
        """Return the newest complete checkpoint.

        Raises:
            RunFolderError: there is none.
        """
        checkpoints = self._checkpoints()
        if not checkpoints:
            raise RunFolderError(
                "resume", str(self.path), "a run with a checkpoint", "Start the run anew."
            )
        return checkpoints[-1]

    def _checkpoints(self) -> list[Path]:
        return sorted((self.path / _CHECKPOINTS).glob("step-*"))


def _first_free(path: Path) -> Path:
    number, candidate = 1, path
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{path.name}-{number}")
    return candidate


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value
