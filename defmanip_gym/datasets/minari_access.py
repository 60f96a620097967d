"""Minari, which is optional: whether it is there, and in which folder it looks for datasets."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from defmanip_gym.errors import DatasetError, InstallationError

_FOLDER_VARIABLE = "MINARI_DATASETS_PATH"
DATA, METADATA = "data", "metadata.json"  # in a dataset's folder, and in there


def require_minari() -> Any:
    """Return the module, with the package that it writes files with.

    Raises:
        InstallationError: one of them is not installed.
    """
    try:
        import h5py  # noqa: F401
        import minari
    except ModuleNotFoundError as error:
        raise InstallationError(
            "the package that datasets need",
            error.name,
            "one that is installed",
            "Install it with: pip install 'defmanip_gym[data]'.",
        ) from error
    return minari


def dataset_root(output: Path | None) -> Path:
    """Return the folder of datasets: that of the user's choice, or Minari's own."""
    if output is not None:
        return output
    own = os.environ.get(_FOLDER_VARIABLE)
    return Path.home() / ".minari" / "datasets" if own is None else Path(own)


@contextmanager
def minari_in(root: Path) -> Iterator[None]:
    """Let Minari look for datasets in ``root``, and put them there."""
    before = os.environ.get(_FOLDER_VARIABLE)
    os.environ[_FOLDER_VARIABLE] = str(root)
    try:
        yield
    finally:
        if before is None:
            del os.environ[_FOLDER_VARIABLE]
        else:
            os.environ[_FOLDER_VARIABLE] = before


def is_dataset(folder: Path) -> bool:
    """Whether a folder is that of a dataset."""
    return (folder / DATA / METADATA).is_file()


def open_dataset(named: str, root: Path) -> Any:
    """Return a dataset by its folder, or by its id in the folder of datasets.

    Raises:
        DatasetError: there is none, or Minari cannot read it.
        InstallationError: Minari is not installed.
    """
    minari = require_minari()
    folder = next(filter(is_dataset, (Path(named), root / named)), None)
    if folder is None:
        raise DatasetError(
            "dataset", named, f"a dataset's folder, or the id of one in {root}", "Name --output."
        )
    try:
        return minari.MinariDataset(folder / DATA)
    except (OSError, ValueError, LookupError, TypeError, AssertionError) as error:
        raise DatasetError(
            "dataset", str(folder), "one that Minari can read", f"It is damaged: {error!r}."
        ) from error
