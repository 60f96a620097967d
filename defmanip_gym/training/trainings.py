"""Many trainings side by side: ``defmanip trainings``."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from filelock import FileLock
from rich.console import Console

from defmanip_gym.errors import RunFolderError
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.run_folder import RunFolder
from defmanip_gym.training.train import train
from defmanip_gym.training.trainings_config import TrainingsConfig
from defmanip_gym.workers import running


def run_trainings(config: TrainingsConfig) -> tuple[Path, ...]:
    """Train what is missing, and return the run folders in the order of ``config.runs``.

    Trainings run in ``config.jobs`` processes. A cluster takes them over as a joblib backend, if
    its workers see the output folder:

        with joblib.parallel_config(backend="dask"): run_trainings(config)

    Ctrl-C ends the processes and exits with 130; the same command goes on from the checkpoints.

    Raises:
        ParameterError: hyperparameters that cannot be used.
        RunFolderError: a folder that cannot be written, or holds a run with other settings.
    """
    console, runs = Console(), config.runs
    console.print(f"{len(runs)} trainings in {config.output}.", highlight=False)
    try:
        with running(train_or_go_on, runs, config.jobs) as results:
            for number, path in enumerate(results, start=1):
                console.print(f"{number} of {len(runs)}: {path}", highlight=False)
    except KeyboardInterrupt:
        console.print("Stopped. Go on from the last checkpoints with the same command.")
        raise SystemExit(130) from None
    return tuple(RunFolder.named(run).path for run in runs)


def train_or_go_on(config: TrainConfig) -> Path:
    """Train as ``config`` says, or go on with the run that has its name; return its folder.

    Nobody else trains it meanwhile: whoever comes second waits, and finds it done.

    Raises:
        ParameterError: hyperparameters that cannot be used.
        RunFolderError: the folder cannot be written, or holds a run with other settings or
            hyperparameters, or from other sources.
    """
    folder = RunFolder.named(config)
    with _only_one(folder):
        if not folder.path.exists():
            return train(config, shows_progress=False)
        _require_the_same(folder, config)
        try:
            folder.last_checkpoint()
        except RunFolderError:  # it ended before its first one
            with folder.held():
                shutil.rmtree(folder.path)
            return train(config, shows_progress=False)
        again = replace(config, resume=folder.path, hyperparameters=None)
        return train(again, shows_progress=False)


@contextmanager
def _only_one(folder: RunFolder) -> Iterator[None]:
    """Wait until nobody else trains a run."""
    lock = FileLock(folder.path.with_name(f".{folder.path.name}.lock"))
    try:
        folder.path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except OSError as error:
        raise RunFolderError(
            "output", str(folder.path.parent), "a writable folder", f"{error}."
        ) from error
    try:
        yield
    finally:
        lock.release()


def _require_the_same(folder: RunFolder, config: TrainConfig) -> None:
    """Raise RunFolderError unless a run was begun with these settings and hyperparameters."""
    run = folder.read_config()
    stored = run.train
    # where it lies and how many threads it has change nothing; of the file the content counts
    same = replace(
        config, output=stored.output, hyperparameters=None, num_threads=stored.num_threads
    )
    given = load_hyperparameters(config.hyperparameters, config.algo, config.env_id)
    if stored != same or run.hyperparameters != json.loads(json.dumps(given)):
        raise RunFolderError(
            "run",
            str(folder.path),
            "one that was begun with these settings",
            "Choose another --output, or train with the same options as before.",
        )
