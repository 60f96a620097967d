"""Finished parts of a reproduction on disk: numbers and time series, without pickle."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from defmanip_gym.errors import RecordError
from defmanip_gym.files import write_atomically
from defmanip_gym.theory.dynamics.chain import Array

Numbers = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Part:
    """One part's outcome.

    Attributes:
        numbers: JSON values for table and page.
        arrays: time series for the figures.
        cpu_s: processor time that it took.
    """

    numbers: Numbers
    arrays: Mapping[str, Array]
    cpu_s: float = 0.0


def fingerprint(settings: Any) -> str:
    """Return the SHA-256 of settings made of dataclasses and JSON values."""
    text = json.dumps(settings, sort_keys=True, default=asdict)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def finished_or_made(path: Path, identity: str, make: Callable[[], Part]) -> Part:
    """Return the part that lies at ``path``, or make it and put it there.

    Raises:
        RecordError: what lies there is damaged or was made with other settings.
    """
    if path.exists():
        return _load(path, identity)
    part = make()
    buffer = io.BytesIO()
    card = {"fingerprint": identity, "cpu_s": part.cpu_s, "numbers": part.numbers}
    arrays: dict[str, Any] = dict(part.arrays)
    np.savez_compressed(buffer, card=np.array(json.dumps(card)), **arrays)
    write_atomically(path, buffer.getvalue())
    return part


def _load(path: Path, identity: str) -> Part:
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        card = json.loads(str(arrays.pop("card")))
        made_with, cpu_s, numbers = card["fingerprint"], card["cpu_s"], card["numbers"]
    except (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise RecordError(
            "part", str(path), "a part written by a reproduction", "Run it again with --fresh."
        ) from error
    if made_with != identity:
        raise RecordError(
            "part",
            str(path),
            "a part made with these very settings and package version",
            "Choose another --output-dir, or pass --fresh to discard what is there.",
        )
    return Part(numbers=numbers, arrays=arrays, cpu_s=cpu_s)
