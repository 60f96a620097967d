"""Time courses of single episodes, for plots and animations."""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.course import Course
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.readings import heading_error, position_from_goal
from defmanip_gym.files import write_atomically
from defmanip_gym.observation import ObservationLayout

Array = NDArray[np.float64]

TRACE_FOLDER = "traces"
SAMPLE_RATE_HZ = 25.0
_STORED_TYPE = np.float32  # a tenth of a micrometre is enough to draw


@dataclass(frozen=True, kw_only=True)
class Trace:
    """One episode at 25 Hz, its last moment included; T samples of N segments.

    Attributes:
        suite: of the scenario.
        contestant: who controlled it.
        member: which of the contestant.
        scenario: name of its start.
        time_s: (T,).
        largest_swing_rad: ‖z2‖∞, (T,).
        swing_rad: φ of each segment, (T, N).
        swing_rate_rad_s: φ̇ of each segment, (T, N).
        margin_rad: σ − ‖z2‖∞, (T,).
        position_m: grasp relative to the goal in axes of the goal's heading, the end-effector
            error, (T, 3).
        heading_rad: θ − θ_goal in (−π, π], (T,).
        base_pose: (x, y, θ) relative to the goal pose of the base, in its axes, θ without jumps,
            (T, 3) m, m, rad.
        joints_rad: (q1, q2), (T, 2).
        requested_m_s2: task acceleration that the controller asked for from here on, base frame,
            (T, 3).
        action_m_s2: the one that took effect, after certificate and delay, (T, 3).
    """

    suite: str
    contestant: str
    member: str
    scenario: str
    time_s: Array
    largest_swing_rad: Array
    swing_rad: Array
    swing_rate_rad_s: Array
    margin_rad: Array
    position_m: Array
    heading_rad: Array
    base_pose: Array
    joints_rad: Array
    requested_m_s2: Array
    action_m_s2: Array

    @property
    def entry_stem(self) -> str:
        """Contestant and member in file names."""
        return f"{self.contestant.replace('/', '+')}.{self.member}"

    def save(self, folder: Path) -> Path:
        """Write the trace into a folder and return the file's path."""
        buffer = io.BytesIO()
        arrays: dict[str, Any] = {}
        for field in fields(self):
            value = np.asarray(getattr(self, field.name))
            arrays[field.name] = value.astype(_STORED_TYPE) if value.ndim else value
        np.savez_compressed(buffer, **arrays)
        path = trace_path(folder, self.suite, self.contestant, self.member, self.scenario)
        write_atomically(path, buffer.getvalue())
        return path


def trace_path(folder: Path, suite: str, contestant: str, member: str, scenario: str) -> Path:
    """Return where the trace of an episode lies in the folder of traces."""
    return folder / suite / f"{contestant.replace('/', '+')}.{member}.{scenario}.npz"


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
            "trace",
            str(path),
            "a trace written by a comparison",
            f"Delete it and its contestant's records in records/{path.parent.name}, and run the "
            "comparison again: it makes both anew.",
        ) from error
    named = {name: str(value) for name, value in values.items() if not value.ndim}
    arrays = {name: value.astype(np.float64) for name, value in values.items() if value.ndim}
    return Trace(**named, **arrays)  # type: ignore[arg-type]


def trace_of(course: Course, entry: Entry, scenario: str, config: TransportConfig) -> Trace:
    """Return an episode's trace.

    Args:
        course: what happened.
        entry: who controlled it, in which suite.
        scenario: name of its start.
        config: the environment's definition.
    """
    task, layout = config.task, ObservationLayout(config.beam.segment_count)
    last = len(course.reward)
    stride = max(1, round(1.0 / (SAMPLE_RATE_HZ * task.control_period_s)))
    moments = np.append(np.arange(0, last, stride), last)
    periods = np.minimum(moments, last - 1)  # what went on until the end
    observation, margin = course.observation[moments], course.margin_rad[moments]
    return Trace(
        suite=entry.suite,
        contestant=entry.contestant,
        member=entry.member,
        scenario=scenario,
        time_s=moments * task.control_period_s,
        largest_swing_rad=config.sigma_rad - margin,
        swing_rad=course.swing_rad[moments],
        swing_rate_rad_s=course.swing_rate_rad_s[moments],
        margin_rad=margin,
        position_m=position_from_goal(observation, layout),
        heading_rad=heading_error(observation, layout),
        base_pose=_from_goal(course.base_pose[moments], task.goal[:3]),
        joints_rad=layout.part(observation, "joints"),
        requested_m_s2=course.requested[periods] * task.max_acceleration_m_s2,
        action_m_s2=course.applied[periods] * task.max_acceleration_m_s2,
    )


def _from_goal(pose: Array, goal: tuple[float, ...]) -> Array:
    """Return planar poses (T, 3) relative to a goal pose, in its axes."""
    dx, dy = pose[:, 0] - goal[0], pose[:, 1] - goal[1]
    cosine, sine = math.cos(goal[2]), math.sin(goal[2])
    return np.column_stack((cosine * dx + sine * dy, cosine * dy - sine * dx, pose[:, 2] - goal[2]))
