"""Two episodes side by side as numbers that the page's script draws, and their first frame."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from defmanip_gym.evaluation.plots.swing import sigma_rad
from defmanip_gym.evaluation.traces import Trace
from defmanip_gym.params import RobotParams

_STRIDE = 2  # 12.5 Hz, and straight lines in between
_ROBOT = RobotParams()


@dataclass(frozen=True, kw_only=True)
class Animation:
    """Episodes of two contestants from one start.

    Attributes:
        heading: what is compared.
        outcomes: how each ended, for readers who cannot see it.
        data: JSON values for the script.
        posters: first frame of each, shown without script.
    """

    heading: str
    outcomes: tuple[str, ...]
    data: Mapping[str, Any]
    posters: tuple[Poster, ...]


@dataclass(frozen=True, kw_only=True)
class Poster:
    """The side view at the start and the path from above, as SVG point lists, m, y downwards.

    Attributes:
        contestant: name.
        colour: its colour.
        arm: shoulder, elbow, grasp.
        beam: grasp and the ends of the segments.
        path: of the grasp, seen from above.
        path_box: the path's view box, min x, min y, width, height.
    """

    contestant: str
    colour: str
    arm: str
    beam: str
    path: str
    path_box: str


def animation(
    heading: str,
    traces: Sequence[Trace],
    colours: Mapping[str, str],
    beam_length_m: float,
    outcomes: Sequence[str],
) -> Animation:
    """Return an animation of traced episodes.

    Args:
        heading: what is compared.
        traces: side by side.
        colours: by contestant.
        beam_length_m: of the carried beam.
        outcomes: of the episodes, in words.
    """
    return Animation(
        heading=heading,
        outcomes=tuple(outcomes),
        data={
            "sigma": round(sigma_rad(traces[0]), 4),
            "shoulder": _ROBOT.shoulder_height_m,
            "links": [_ROBOT.upper_arm.length_m, _ROBOT.forearm.length_m],
            "segment": beam_length_m / traces[0].swing_rad.shape[1],
            "episodes": [_episode(trace, colours[trace.contestant]) for trace in traces],
        },
        posters=tuple(_poster(trace, colours[trace.contestant], beam_length_m) for trace in traces),
    )


def _episode(trace: Trace, colour: str) -> dict[str, Any]:
    last = len(trace.time_s) - 1
    kept = np.append(np.arange(0, last, _STRIDE), last)
    columns = {
        "t": trace.time_s,
        "x": trace.base_pose[:, 0],
        "y": trace.base_pose[:, 1],
        "heading": trace.base_pose[:, 2],
        "q1": trace.joints_rad[:, 0],
        "q2": trace.joints_rad[:, 1],
    }
    return {
        "name": trace.contestant,
        "colour": colour,
        **{name: _short(values[kept]) for name, values in columns.items()},
        "phi": [_short(segment) for segment in trace.swing_rad[kept].T],
    }


def _short(values: Any) -> list[float]:
    """Return numbers to the millimetre, milliradian and millisecond."""
    return [round(value, 3) for value in values.tolist()]


def _poster(trace: Trace, colour: str, beam_length_m: float) -> Poster:
    links = (_ROBOT.upper_arm.length_m, _ROBOT.forearm.length_m)
    q1, q2 = trace.joints_rad[0].tolist()
    arm = [(0.0, _ROBOT.shoulder_height_m)]
    for length, pitch in zip(links, (q1, q1 + q2), strict=True):
        x, z = arm[-1]
        arm.append((x + length * math.cos(pitch), z + length * math.sin(pitch)))
    beam = [arm[-1]]
    segments = trace.swing_rad[0].tolist()
    for phi in segments:
        x, z = beam[-1]
        length = beam_length_m / len(segments)
        beam.append((x + length * math.sin(phi), z - length * math.cos(phi)))
    path = trace.position_m[:: 4 * _STRIDE, :2]
    low, high = path.min(axis=0) - 1.0, path.max(axis=0) + 1.0
    box = (low[0], -high[1], high[0] - low[0], high[1] - low[1])
    return Poster(
        contestant=trace.contestant,
        colour=colour,
        arm=_points(arm),
        beam=_points(beam),
        path=_points(path.tolist()),
        path_box=" ".join(f"{value:.2f}" for value in box),
    )


def _points(pairs: Sequence[Sequence[float]]) -> str:
    return " ".join(f"{x:.2f},{-y:.2f}" for x, y in pairs)
