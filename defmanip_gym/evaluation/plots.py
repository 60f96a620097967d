"""The comparison's plots, drawn from traces; each function returns a figure of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from defmanip_gym.evaluation.scenarios import PAPER_SCENARIO
from defmanip_gym.evaluation.traces import Trace

Colours = Mapping[str, str]

_INK, _FAINT, _BAND, _GOAL = "#333333", "#d9d9d9", "#e8f3ec", "#f2c230"
_SHORTEST_AXIS_S = 2.0
_COMPONENTS: tuple[tuple[int, str, float, Literal["-", "--", ":"]], ...] = (
    (0, "forward", 1.3, "-"),
    (1, "left", 0.9, "--"),
    (2, "up", 0.9, ":"),
)


@dataclass(frozen=True, kw_only=True)
class Plot:
    """A kind of plot.

    Attributes:
        name: of its file, without suffix.
        title: for the report.
        caption: how to read it.
        draw: makes it from traces and the contestants' colours.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[Sequence[Trace], Colours], Figure]


def plot_swing(traces: Sequence[Trace], colours: Colours) -> Figure:
    """Draw the swing over time against ±σ, one panel per contestant."""
    figure, panels = _panels(_contestants(traces, colours))
    sigma_deg = math.degrees(_sigma_rad(traces[0]))
    for name, axes in panels.items():
        own = [trace for trace in traces if trace.contestant == name]
        axes.axhspan(-sigma_deg, sigma_deg, color=_BAND, zorder=0)
        for bound in (-sigma_deg, sigma_deg):
            axes.axhline(bound, color="#6a9c7d", linewidth=0.8, linestyle="--", zorder=1)
        for trace in own:
            _line(axes, trace.time_s, np.degrees(trace.swing_rad), colours[name], trace)
        largest = max(trace.largest_swing_rad.max() for trace in own) / _sigma_rad(traces[0])
        axes.set_title(f"max |φ| = {largest:.2f} σ", loc="right", fontsize=8, color=_INK)
        axes.set_ylim(-1.5 * sigma_deg, 1.5 * sigma_deg)
        axes.set_xlim(0.0, _duration_s(own))
        axes.set_yticks((-sigma_deg, 0.0, sigma_deg), ("−σ", "0", "+σ"))
    figure.supxlabel("time (s)", fontsize=9, color=_INK)
    figure.supylabel(f"swing φ (σ = {sigma_deg:.0f}°)", fontsize=9, color=_INK)
    return figure


def plot_actions(traces: Sequence[Trace], colours: Colours) -> Figure:
    """Draw the applied task acceleration over time from the paper's start."""
    paper = _first_scenario(traces)
    figure, panels = _panels(_contestants(paper, colours))
    for trace in paper:
        axes, colour = panels[trace.contestant], colours[trace.contestant]
        for axis, _, width, style in reversed(_COMPONENTS):  # forward on top
            ink = _INK if style == ":" else colour
            values = trace.action_m_s2[:, axis]
            axes.plot(trace.time_s, values, color=ink, linewidth=width, linestyle=style)
        largest = float(np.abs(trace.action_m_s2).max())
        limit = 1.15 * largest if largest > 0 else 1.0
        axes.set_ylim(-limit, limit)
        axes.set_xlim(0.0, _duration_s([trace]))
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2), useMathText=True)
    handles = [
        Line2D([], [], color=_INK, linewidth=width, linestyle=style, label=label)
        for _, label, width, style in _COMPONENTS
    ]
    _legend_above(figure, handles)
    figure.supxlabel("time (s)", fontsize=9, color=_INK)
    figure.supylabel("applied acceleration of the grasp (m/s²)", fontsize=9, color=_INK)
    return figure


def plot_paths(traces: Sequence[Trace], colours: Colours) -> Figure:
    """Draw the paths of the grasp in the plane, one panel per scenario."""
    scenarios = list(dict.fromkeys(trace.scenario for trace in traces))
    rows = math.ceil(len(scenarios) / 2)
    points = np.concatenate([trace.position_m[:, :2] for trace in traces] + [np.zeros((1, 2))])
    low, high = points.min(axis=0) - 0.7, points.max(axis=0) + 0.7
    panel_height = float(np.clip(4.2 * (high[1] - low[1]) / (high[0] - low[0]), 1.5, 5.0))
    figure = Figure(figsize=(9.0, 0.7 + (panel_height + 0.3) * rows), layout="constrained")
    grid = figure.subplots(rows, min(2, len(scenarios)), squeeze=False, sharex=True, sharey=True)
    for axes, scenario in zip(grid.flat, scenarios, strict=False):
        own = [trace for trace in traces if trace.scenario == scenario]
        for trace in own:
            x, y = trace.position_m[:, 0], trace.position_m[:, 1]
            colour = colours[trace.contestant]
            axes.plot(x, y, color=colour, linewidth=1.4, alpha=0.9)
            axes.plot(x[-1], y[-1], "o", color=colour, markersize=4, zorder=3)
        start = own[0].position_m[0]
        axes.plot(start[0], start[1], "o", markersize=9, markerfacecolor="none", color=_INK)
        axes.plot(0.0, 0.0, "*", markersize=13, color=_GOAL, markeredgecolor=_INK, zorder=4)
        axes.set_title(scenario, loc="left", fontsize=10, color=_INK)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        _clean(axes)
    for axes in grid.flat[len(scenarios) :]:
        axes.set_axis_off()
    start_mark = Line2D([], [], color=_INK, marker="o", markerfacecolor="none", label="start")
    goal_mark = Line2D([], [], color=_GOAL, marker="*", markeredgecolor=_INK, label="goal")
    for mark, size in ((start_mark, 8), (goal_mark, 11)):
        mark.set(linestyle="none", markersize=size)
    _legend_above(figure, [*_contestant_handles(traces, colours), start_mark, goal_mark])
    figure.supxlabel("x from the goal (m)", fontsize=9, color=_INK)
    figure.supylabel("y from the goal (m)", fontsize=9, color=_INK)
    return figure


def plot_errors(traces: Sequence[Trace], colours: Colours) -> Figure:
    """Draw the end-effector's errors over time from the paper's start."""
    paper = _first_scenario(traces)
    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True)
    labels = ("x error (m)", "y error (m)", "height error (m)", "heading error (°)")
    for index, (axes, label) in enumerate(zip(grid.flat, labels, strict=True)):
        axes.axhline(0.0, color=_FAINT, linewidth=1.0, zorder=0)
        for trace in paper:
            error = np.degrees(trace.heading_rad) if index == 3 else trace.position_m[:, index]
            colour = colours[trace.contestant]
            axes.plot(trace.time_s, error, color=colour, linewidth=1.4)
            axes.plot(trace.time_s[-1], error[-1], "o", color=colour, markersize=4)
        axes.set_title(label, loc="left", fontsize=10, color=_INK)
        axes.set_xlim(0.0, _interesting_s(paper))
        _clean(axes)
    _legend_above(figure, _contestant_handles(paper, colours))
    figure.supxlabel("time (s)", fontsize=9, color=_INK)
    return figure


PLOTS = (
    Plot(
        name="swing",
        title="Swing against ±σ",
        caption="Swing over time, each panel on its own time axis; the strong line is the paper's "
        "start, a dot the end of an episode. Swings beyond 1.5 σ are cut off.",
        draw=plot_swing,
    ),
    Plot(
        name="paths",
        title="Paths in the plane",
        caption="The grasp from above; a dot marks where an episode ended. The robot must arrive "
        "heading along +x.",
        draw=plot_paths,
    ),
    Plot(
        name="errors",
        title="End-effector errors",
        caption="From the paper's start, in axes of the goal; a dot marks the end of an episode. "
        "The time axis stops soon after the last contestant that reached the goal.",
        draw=plot_errors,
    ),
    Plot(
        name="actions",
        title="Actions",
        caption="Applied acceleration of the grasp from the paper's start, in the base frame and "
        "after the ν_max wrapper where there is one. Every panel has its own scale.",
        draw=plot_actions,
    ),
)


def _panels(contestants: Sequence[str]) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure with a titled panel for each contestant."""
    rows = math.ceil(len(contestants) / 2)
    figure = Figure(figsize=(9.0, 0.6 + 1.7 * rows), layout="constrained")
    grid = figure.subplots(rows, min(2, len(contestants)), squeeze=False)
    for axes, name in zip(grid.flat, contestants, strict=False):
        axes.set_title(name, loc="left", fontsize=10, fontweight="bold", color=_INK)
        _clean(axes)
    for axes in grid.flat[len(contestants) :]:
        axes.set_axis_off()
    return figure, dict(zip(contestants, grid.flat, strict=False))


def _line(axes: Axes, x: np.ndarray, y: np.ndarray, colour: str, trace: Trace) -> None:
    strong = trace.scenario == PAPER_SCENARIO
    width, alpha = (1.3, 1.0) if strong else (0.8, 0.45)
    axes.plot(x, y, color=colour, linewidth=width, alpha=alpha, zorder=3 if strong else 2)
    axes.plot(x[-1], y[-1], "o", color=colour, markersize=3.5, alpha=alpha, zorder=4)


def _clean(axes: Axes) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#999999")
    axes.tick_params(labelsize=8, color="#999999", labelcolor=_INK)


def _legend_above(figure: Figure, handles: Sequence[Line2D]) -> None:
    figure.legend(
        handles=list(handles),
        loc="outside upper center",
        ncols=min(len(handles), 9),
        fontsize=8,
        frameon=False,
        handlelength=1.6,
        columnspacing=1.2,
    )


def _contestants(traces: Sequence[Trace], colours: Colours) -> list[str]:
    present = {trace.contestant for trace in traces}
    return [name for name in colours if name in present]


def _contestant_handles(traces: Sequence[Trace], colours: Colours) -> list[Line2D]:
    return [
        Line2D([], [], color=colours[name], linewidth=2.0, label=name)
        for name in _contestants(traces, colours)
    ]


def _first_scenario(traces: Sequence[Trace]) -> list[Trace]:
    return [trace for trace in traces if trace.scenario == traces[0].scenario]


def _sigma_rad(trace: Trace) -> float:
    return float(trace.margin_rad[0] + trace.largest_swing_rad[0])


def _duration_s(traces: Sequence[Trace]) -> float:
    """Return the length of a time axis, with room for the last dot."""
    return 1.02 * max(_SHORTEST_AXIS_S, *(float(trace.time_s[-1]) for trace in traces))


def _interesting_s(traces: Sequence[Trace]) -> float:
    """Return a time axis on which those that arrive fill most of the width."""
    arrived = [trace for trace in traces if np.linalg.norm(trace.position_m[-1]) < 0.1]
    return 1.1 * _duration_s(arrived) if arrived else _duration_s(traces)
