"""Plans on disk: one compressed file without code.

States and commands are whole numbers of a step per quantity (``_STEPS``), which costs less than
the model leaves out and makes the file small.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import RecordError
from defmanip_gym.files import write_atomically
from defmanip_gym.planning.model import COMMAND_SIZE, STATE_SIZE
from defmanip_gym.planning.plan import Plan
from defmanip_gym.planning.stored import StoredPlan, StoredPlans

# m, rad, m/s, m, m/s, rad, rad/s in the order of ``STATE``, then m/s²
_STEPS = np.array([1e-3, 1e-3, 1e-4, 5e-4, *[1e-4] * 3, 1e-4, 1e-4, 1e-4, 5e-4, *[2e-4] * 3])
_KEYS = ("made_with", "starts", "optima_s", "optimal_guesses", "durations_s", "guesses", "motions")
_REMEDY = "Let `defmanip plan` write it anew."


def write_plans(path: Path, stored: StoredPlans) -> None:
    """Write the file, as a whole or not at all."""
    drives = [plan.drive for plan in stored.plans]
    motions = [
        np.hstack((drive.states, np.vstack((drive.commands, np.zeros(COMMAND_SIZE)))))
        for drive in drives
    ]
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        made_with=np.array(json.dumps(stored.made_with, sort_keys=True)),
        starts=stored.starts,
        optima_s=np.array([plan.optimum_s for plan in stored.plans]).round(5),
        optimal_guesses=np.array([plan.optimal_guess for plan in stored.plans]),
        durations_s=np.array([drive.duration_s for drive in drives]).round(5),
        guesses=np.array([drive.guess for drive in drives]),
        motions=_differences(np.round(np.array(motions) / _STEPS).astype(np.int32)),
    )
    write_atomically(path, buffer.getvalue())


def read_plans(path: Path) -> StoredPlans:
    """Return the plans of a file.

    Raises:
        RecordError: there is no such file, or it is another program's.
    """
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return _unpacked({key: arrays[key] for key in _KEYS})
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise RecordError(
            f"plans in {path}", str(error), "a file that `defmanip plan` wrote", _REMEDY
        ) from error


@lru_cache(maxsize=1)
def shipped_plans() -> StoredPlans:
    """Return the plans that come with the package: of every start of every suite."""
    return read_plans(Path(str(files("defmanip_gym.planning") / "plans.npz")))


def _differences(counts: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return differences along the motion, which compress well."""
    return np.diff(counts, axis=1, prepend=0) if counts.size else counts


def _unpacked(arrays: Mapping[str, NDArray[Any]]) -> StoredPlans:
    motions = np.cumsum(arrays["motions"], axis=1) * _STEPS if len(arrays["starts"]) else []
    plans = tuple(
        StoredPlan(
            start=tuple(start),
            optimum_s=optimum,
            optimal_guess=optimal_guess,
            drive=Plan(
                duration_s=duration,
                states=motion[:, :STATE_SIZE],
                commands=motion[:-1, STATE_SIZE:],
                guess=guess,
            ),
        )
        for start, optimum, optimal_guess, duration, guess, motion in zip(
            arrays["starts"].tolist(),
            arrays["optima_s"].tolist(),
            arrays["optimal_guesses"].tolist(),
            arrays["durations_s"].tolist(),
            arrays["guesses"].tolist(),
            motions,
            strict=True,
        )
    )
    return StoredPlans(made_with=json.loads(str(arrays["made_with"])), plans=plans)
