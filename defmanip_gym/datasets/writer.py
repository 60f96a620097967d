"""Writing episodes with Minari, so that a dataset is there as a whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.datasets.minari_access import is_dataset, minari_in, require_minari
from defmanip_gym.datasets.mixture import Part
from defmanip_gym.errors import DatasetError
from defmanip_gym.evaluation.course import Course

AUTHOR = "the defmanip_gym contributors"


class DatasetWriter:
    """Appends episodes to a dataset.

    Args:
        dataset: Minari's, just made.
        root: folder of datasets, for messages.
    """

    def __init__(self, dataset: Any, root: Path) -> None:
        self._storage, self._root = dataset.storage, root
        self._count = 0

    def describe(self, metadata: dict[str, Any]) -> None:
        """Add to the dataset's metadata, JSON values."""
        with _writable(self._root):
            self._storage.update_metadata(metadata)

    def add(self, part: Part, seeds: Sequence[int], courses: Sequence[Course]) -> None:
        """Append episodes of a part, each with its seed and its controller's name."""
        numbers = range(self._count, self._count + len(courses))
        buffers = [_buffer(*each) for each in zip(numbers, seeds, courses, strict=True)]
        controller = {"contestant": part.contestant.name, "member": part.member.name}
        with _writable(self._root):
            self._storage.update_episodes(buffers)
            self._storage.update_episode_metadata([controller] * len(courses), numbers)
        self._count += len(courses)


@contextmanager
def new_dataset(
    name: str,
    root: Path,
    env: gymnasium.Env[Any, Any],
    *,
    algorithm: str,
    description: str,
    requirements: Sequence[str],
    overwrite: bool,
) -> Iterator[DatasetWriter]:
    """Give a writer of a dataset that appears in ``root`` when the block ends without exception.

    Args:
        name: id of the dataset.
        root: folder of datasets.
        env: that makes its episodes again.
        algorithm: who controlled.
        description: for readers.
        requirements: what makes the same episodes, as pip reads it.
        overwrite: replace a dataset of that id.

    Raises:
        DatasetError: there is something of that name already, or the folder cannot be written.
        InstallationError: Minari is not installed.
    """
    minari = require_minari()
    root = root.absolute()
    target = root / name
    _require_outside(target, root)
    if target.exists() and not (overwrite and is_dataset(target)):
        allowed = "an id that is free, or --overwrite" if is_dataset(target) else "a free id"
        raise DatasetError("dataset", str(target), allowed, "Choose another, or another --output.")
    with _writable(root):
        root.mkdir(parents=True, exist_ok=True)
        stage = Path(tempfile.mkdtemp(dir=root, prefix=".writing-"))
    try:
        with _writable(root), minari_in(stage), warnings.catch_warnings():
            # an address and a link to the code are not ours to give; this env is for evaluation
            warnings.simplefilter("ignore", UserWarning)
            dataset = minari.create_dataset_from_buffers(
                name,
                [],
                env=env,
                algorithm_name=algorithm,
                author=AUTHOR,
                description=description,
                requirements=list(requirements),
            )
        yield DatasetWriter(dataset, root)
        with _writable(root), minari_in(root):
            _publish(stage / name, target, stage, overwrite=overwrite)
            _name_namespace(name)
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _buffer(number: int, seed: int, course: Course) -> Any:
    """Return an episode as Minari takes it; infos begin with the reset's, like observations."""
    from minari.data_collector.episode_buffer import EpisodeBuffer

    steps = len(course.reward)
    ends = np.arange(steps) == steps - 1
    successes = np.zeros(steps + 1, dtype=bool)
    successes[-1] = course.reached_goal
    infos = {
        "cost": course.cost,
        "constraint_margin": course.margin_rad,
        "is_success": successes,
    }
    if course.intervened is not None:
        infos["wished_action"] = np.concatenate((np.zeros((1, 3)), course.requested))
    return EpisodeBuffer(
        id=number,
        seed=seed,
        observations=course.observation,
        actions=course.applied,
        rewards=course.reward,
        terminations=ends & course.terminated,
        truncations=ends & (not course.terminated),
        infos=infos,
    )


def _require_outside(target: Path, root: Path) -> None:
    """Raise DatasetError within another dataset, which takes all with it when it is replaced."""
    above = target.relative_to(root).parents
    for folder in (root / each for each in above):
        if is_dataset(folder):
            raise DatasetError(
                "dataset", str(target), f"an id outside of the dataset {folder}", "Choose another."
            )


def _publish(made: Path, target: Path, stage: Path, *, overwrite: bool) -> None:
    """Put a finished dataset in its place; whatever interrupts this leaves the old or the new.

    What somebody else has put there meanwhile stays unless it may be replaced.
    """
    replaced = stage / "replaced"
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        if overwrite and target.exists():
            os.rename(target, replaced)
        os.rename(made, target)
    finally:
        if replaced.exists() and not target.exists():
            os.rename(replaced, target)


def _name_namespace(name: str) -> None:
    """Let Minari know the namespace of a dataset, if it has one."""
    from minari.namespace import create_namespace, list_local_namespaces

    namespace = name.rpartition("/")[0]
    if namespace and namespace not in list_local_namespaces():
        create_namespace(namespace)


@contextmanager
def _writable(root: Path) -> Iterator[None]:
    """Raise DatasetError where the folder of datasets cannot be written."""
    try:
        yield
    except OSError as error:
        raise DatasetError(
            "output", str(root), "a folder that can be written", f"{error}."
        ) from error
