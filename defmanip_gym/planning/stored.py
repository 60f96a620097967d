"""Plans that were made once, as a file without code: optimal times, and plans to be driven.

States and commands are whole numbers of a step per quantity (``_STEPS``), which costs less than
the model leaves out and makes the file small.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import RecordError
from defmanip_gym.files import write_atomically
from defmanip_gym.planning.model import COMMAND_SIZE, STATE_SIZE, Array
from defmanip_gym.planning.plan import Plan

# m, rad, m/s, m, m/s, rad, rad/s in the order of ``STATE``, then m/s²
_STEPS = np.array([1e-3, 1e-3, 1e-4, 5e-4, *[1e-4] * 3, 1e-4, 1e-4, 1e-4, 5e-4, *[2e-4] * 3])
_ALIKE = 1e-4  # m and rad: starts closer than that are one
_KEYS = ("made_with", "starts", "optima_s", "optimal_guesses", "durations_s", "guesses", "motions")


@dataclass(frozen=True, kw_only=True)
class StoredPlan:
    """What is known of a start.

    Attributes:
        start: (x, y, θ, q1, q2, φ), m and rad.
        optimum_s: T*, without margins.
        optimal_guess: what led to it.
        drive: a plan with margins.
    """

    start: tuple[float, ...]
    optimum_s: float
    optimal_guess: str
    drive: Plan


@dataclass(frozen=True, kw_only=True)
class StoredPlans:
    """Plans by start.

    Attributes:
        made_with: model, limits and programs that they were made with, as JSON values.
        plans: one a start.
    """

    made_with: Mapping[str, Any]
    plans: tuple[StoredPlan, ...] = ()

    def find(
        self, start: Sequence[float] | Array, *, swing_tolerance_rad: float = _ALIKE
    ) -> StoredPlan | None:
        """Return what is known of a start (x, y, θ, q1, q2, φ); None where nothing is.

        Args:
            start: m and rad; the heading may have any number of turns.
            swing_tolerance_rad: by how much the swing, which noisy sensors tell, may differ.
        """
        if not self.plans:
            return None
        away = np.abs(self._starts - np.asarray(start))
        away[:, 2] = np.abs(np.remainder(away[:, 2] + np.pi, 2 * np.pi) - np.pi)
        away[:, 5] *= _ALIKE / swing_tolerance_rad
        nearest = int(np.argmin(away.max(axis=1)))
        return self.plans[nearest] if away[nearest].max() < _ALIKE else None

    def including(self, plan: StoredPlan) -> StoredPlans:
        """Return these and one more, in place of an old one of the same start."""
        others = tuple(old for old in self.plans if old.start != plan.start)
        return replace(self, plans=(*others, plan))

    def write(self, path: Path) -> None:
        """Write the file, as a whole or not at all."""
        drives = [plan.drive for plan in self.plans]
        motions = [
            np.hstack((drive.states, np.vstack((drive.commands, np.zeros(COMMAND_SIZE)))))
            for drive in drives
        ]
        buffer = io.BytesIO()
        np.savez_compressed(
            buffer,
            made_with=np.array(json.dumps(self.made_with, sort_keys=True)),
            starts=self._starts,
            optima_s=np.array([plan.optimum_s for plan in self.plans]).round(5),
            optimal_guesses=np.array([plan.optimal_guess for plan in self.plans]),
            durations_s=np.array([drive.duration_s for drive in drives]).round(5),
            guesses=np.array([drive.guess for drive in drives]),
            motions=_differences(np.round(np.array(motions) / _STEPS).astype(np.int32)),
        )
        write_atomically(path, buffer.getvalue())

    @staticmethod
    def read(path: Path) -> StoredPlans:
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

    @property
    def digest(self) -> str:
        """SHA-256 of the plans."""
        content = hashlib.sha256()
        for plan in self.plans:
            content.update(np.array([*plan.start, plan.optimum_s, plan.drive.duration_s]).tobytes())
            content.update(plan.drive.states.tobytes() + plan.drive.commands.tobytes())
        return content.hexdigest()

    @cached_property
    def _starts(self) -> Array:
        return np.array([plan.start for plan in self.plans]).reshape(-1, 6)


_REMEDY = "Let `defmanip plan` write it anew."


@lru_cache(maxsize=1)
def shipped_plans() -> StoredPlans:
    """Return the plans that come with the package: of every start of every suite."""
    return StoredPlans.read(Path(str(files("defmanip_gym.planning") / "plans.npz")))


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
