"""Time courses of single episodes, for plots."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.readings import heading_error, position_from_goal
from defmanip_gym.evaluation.scenarios import Scenario
from defmanip_gym.files import write_atomically
from defmanip_gym.observation import ObservationLayout

Array = NDArray[np.float64]

SAMPLE_RATE_HZ = 25.0


@dataclass(frozen=True, kw_only=True)
class Trace:
    """One episode at 25 Hz, its last moment included; T samples.

    Attributes:
        contestant: who controlled it.
        scenario: name of its start.
        time_s: (T,).
        largest_swing_rad: ‖z2‖∞, (T,).
        swing_rad: φ of the first segment, (T,).
        margin_rad: σ − ‖z2‖∞, (T,).
        position_m: grasp relative to the goal in axes of the goal's heading, the end-effector
            error, (T, 3).
        heading_rad: θ − θ_goal, (T,).
        action_m_s2: task acceleration handed to the robot from here on, after any wrapper, in the
            base frame, (T, 3).
    """

    contestant: str
    scenario: str
    time_s: Array
    largest_swing_rad: Array
    swing_rad: Array
    margin_rad: Array
    position_m: Array
    heading_rad: Array
    action_m_s2: Array

    def save(self, folder: Path) -> Path:
        """Write the trace into a folder and return the file's path."""
        buffer = io.BytesIO()
        arrays: dict[str, Any] = {
            field.name: np.asarray(getattr(self, field.name)) for field in fields(self)
        }
        np.savez_compressed(buffer, **arrays)
        path = trace_path(folder, self.contestant, self.scenario)
        write_atomically(path, buffer.getvalue())
        return path


def trace_path(folder: Path, contestant: str, scenario: str) -> Path:
    """Return where the trace of an episode lies."""
    return folder / f"{contestant.replace('/', '-')}.{scenario}.npz"


def load_trace(path: Path) -> Trace:
    """Read a trace.

    Raises:
        RecordError: the file is not a trace.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            values = {field.name: file[field.name] for field in fields(Trace)}
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise RecordError(
            "trace", str(path), "a trace written by a comparison", "Run it again with --fresh."
        ) from error
    contestant, scenario = str(values.pop("contestant")), str(values.pop("scenario"))
    return Trace(contestant=contestant, scenario=scenario, **values)


class TraceRecorder:
    """Collects the time courses of some episodes of a batch.

    Args:
        contestant: who controls them.
        scenarios: of the whole batch.
        traced: names of those wanted.
        config: the environment's definition.
    """

    def __init__(
        self,
        contestant: str,
        scenarios: Sequence[Scenario],
        traced: Collection[str],
        config: TransportConfig,
    ) -> None:
        names = [scenario.name for scenario in scenarios]
        self._names = {i: name for i, name in enumerate(names) if name in traced}
        self._contestant, self._task, self._sigma_rad = contestant, config.task, config.sigma_rad
        self._layout = ObservationLayout(config.beam.segment_count)
        self._rows: dict[int, list[Array]] = {index: [] for index in self._names}

    def add(self, observation: Array, margin_rad: Array, actions: Array) -> None:
        """Keep the samples of one control period.

        Args:
            observation: at its beginning, (n, size).
            margin_rad: then, (n,).
            actions: applied during it, normalized, (n, 3).
        """
        ids = list(self._rows)
        if ids:
            samples = self._samples(observation[ids], margin_rad[ids], actions[ids])
            for index, sample in zip(ids, samples, strict=True):
                self._rows[index].append(sample)

    def finish(
        self, index: int, observation: Array, margin_rad: Array, actions: Array
    ) -> Trace | None:
        """Return the trace of an episode that has just ended, None if it was not wanted.

        The arguments are as for ``add``, now of its last moment.
        """
        rows = self._rows.pop(index, None)
        if rows is None:
            return None
        one = slice(index, index + 1)
        last = self._samples(observation[one], margin_rad[one], actions[one])
        stride = max(1, round(1.0 / (SAMPLE_RATE_HZ * self._task.control_period_s)))
        times = np.append(np.arange(0, len(rows), stride), len(rows))
        values = np.concatenate((np.array(rows)[::stride], last))
        return Trace(
            contestant=self._contestant,
            scenario=self._names[index],
            time_s=times * self._task.control_period_s,
            margin_rad=values[:, 0],
            largest_swing_rad=self._sigma_rad - values[:, 0],
            swing_rad=values[:, 1],
            heading_rad=values[:, 2],
            position_m=values[:, 3:6],
            action_m_s2=values[:, 6:],
        )

    def _samples(self, observation: Array, margin_rad: Array, actions: Array) -> Array:
        columns = (
            margin_rad,
            self._layout.part(observation, "swing")[:, 0],
            heading_error(observation, self._layout),
            position_from_goal(observation, self._layout),
            actions * self._task.max_acceleration_m_s2,
        )
        return np.column_stack(columns)
