"""Figures 2 to 5 of the paper, and those of the studies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from defmanip_gym.reproduction.course import FORCE_ERROR, POSITION, Course
from defmanip_gym.reproduction.parts import Numbers
from defmanip_gym.reproduction.setting import SIGMA_RAD
from defmanip_gym.theory.dynamics.chain import Array

Arrays = Mapping[str, Array]

DPI = 130
_WIDTH = 8.0
_INK, _FAINT = "#333333", "#d9d9d9"
_COLOURS = ("#1f5f8b", "#c8553d", "#5b8c5a")
_STATES = ("x (m)", "y (m)", "θ (rad)", "$q_1$ (rad)", "$q_2$ (rad)", "φ (rad)")
_SECONDS_PER_HOUR = 3600.0


@dataclass(frozen=True, kw_only=True)
class Illustration:
    """A figure of the page.

    Attributes:
        name: of its file, without suffix.
        part: what it shows.
        draw: makes it from the part's numbers and arrays.
    """

    name: str
    part: str
    draw: Callable[[Numbers, Arrays], Figure]


def figure_2(numbers: Numbers, arrays: Arrays) -> Figure:
    """Draw the configuration (x, y, θ, q1, q2, φ) over time."""
    course = Course(**arrays)
    figure = Figure(figsize=(_WIDTH, 4.4), layout="constrained")
    for index, axes in enumerate(figure.subplots(2, 3, sharex=True).flat):
        _course(axes, course, index, _COLOURS[0])
        axes.set_title(_STATES[index], loc="left", fontsize=10, color=_INK)
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 3), useMathText=True)
        _clean(axes)
    figure.supxlabel("time (h)", fontsize=9, color=_INK)
    return figure


def figure_3(numbers: Numbers, arrays: Arrays) -> Figure:
    """Draw the swing angle over time, and once more against the admissible ±σ."""
    course = Course(**arrays)
    figure = Figure(figsize=(_WIDTH, 3.2), layout="constrained")
    close, far = figure.subplots(1, 2, width_ratios=(3, 1))
    for axes in (close, far):
        _course(axes, course, 5, _COLOURS[0])
        axes.set_xlabel("time (h)", fontsize=9, color=_INK)
        _clean(axes)
    close.set_title("swing angle φ (rad)", loc="left", fontsize=10, color=_INK)
    close.ticklabel_format(axis="y", style="sci", scilimits=(0, 0), useMathText=True)
    far.set_title("against ±σ", loc="left", fontsize=10, color=_INK)
    far.set_ylim(-1.2 * SIGMA_RAD, 1.2 * SIGMA_RAD)
    far.set_yticks((-SIGMA_RAD, 0.0, SIGMA_RAD), ("−π/6", "0", "π/6"))
    for bound in (-SIGMA_RAD, SIGMA_RAD):
        far.axhline(bound, color=_COLOURS[1], linewidth=1.0, linestyle="--")
    return figure


def figure_4(numbers: Numbers, arrays: Arrays) -> Figure:
    """Draw the position errors of the end effector over time."""
    course = Course(**arrays)
    figure = Figure(figsize=(_WIDTH, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.axhline(0.0, color=_FAINT, linewidth=1.0, zorder=0)
    for offset, name in enumerate("xyz"):
        _course(axes, course, POSITION.start + offset, _COLOURS[offset], label=name)
    axes.legend(frameon=False, fontsize=9)
    axes.set_xlabel("time (h)", fontsize=9, color=_INK)
    axes.set_title("end-effector position error (m)", loc="left", fontsize=10, color=_INK)
    _clean(axes)
    return figure


def figure_5(numbers: Numbers, arrays: Arrays) -> Figure:
    """Draw Δu_o over time: its first half second, and what the noise leaves of it afterwards."""
    course = Course(**arrays)
    figure = Figure(figsize=(_WIDTH, 5.6), layout="constrained")
    grid = figure.subplots(3, 2, width_ratios=(1, 2), sharex="col")
    early = course.opening_time_s <= 0.5
    for row, name in enumerate(("forward", "left", "up")):
        column, colour = FORCE_ERROR.start + row, _COLOURS[row]
        first, later = grid[row]
        values = course.opening[early, column]
        first.plot(course.opening_time_s[early], values, color=colour, linewidth=1.2)
        first.set_title(f"$\\Delta u_o$ {name} (m/s²)", loc="left", fontsize=10, color=_INK)
        low, high = course.low[1:, column], course.high[1:, column]
        hours = course.time_s[1:] / _SECONDS_PER_HOUR
        later.fill_between(hours, low, high, color=colour, linewidth=0.0, alpha=0.8)
        later.set_title("afterwards, extremes", loc="left", fontsize=10, color=_INK)
        for axes in (first, later):
            axes.ticklabel_format(axis="y", style="sci", scilimits=(0, 0), useMathText=True)
            _clean(axes)
    grid[2, 0].set_xlabel("time (s)", fontsize=9, color=_INK)
    grid[2, 1].set_xlabel("time (h)", fontsize=9, color=_INK)
    return figure


def damping_figure(numbers: Numbers, arrays: Arrays) -> Figure:
    """Draw the swing under each assumed damping, with the predicted envelope."""
    cases = numbers["cases"]
    figure = Figure(figsize=(_WIDTH, 3.0), layout="constrained")
    for index, (case, axes) in enumerate(
        zip(cases, figure.subplots(1, len(cases)).flat, strict=True)
    ):
        time_s, swing = arrays[f"time_s_{index}"], arrays[f"swing_{index}"]
        envelope = abs(swing[0]) * np.exp(case["predicted_growth_per_s"] * time_s)
        top = 1.15 * max(float(np.abs(swing).max()), abs(float(swing[0])))
        for sign in (-1.0, 1.0):
            axes.plot(time_s, sign * envelope, color=_INK, linewidth=0.8, linestyle=":")
        axes.plot(time_s, swing, color=_COLOURS[index], linewidth=1.2)
        axes.set_ylim(-top, top)
        axes.set_title(f"d̂ = {case['assumed_damping']:g}", loc="left", fontsize=10, color=_INK)
        axes.set_xlabel("time (s)", fontsize=9, color=_INK)
        _clean(axes)
    figure.supylabel("swing φ (rad)", fontsize=9, color=_INK)
    return figure


def l1_figure(numbers: Numbers, arrays: Arrays) -> Figure:
    """Draw the transport under ``l1``: position errors, and the swing against σ."""
    figure = Figure(figsize=(_WIDTH, 3.0), layout="constrained")
    errors, swing = figure.subplots(1, 2)
    errors.axhline(0.0, color=_FAINT, linewidth=1.0, zorder=0)
    for axis, name in enumerate("xyz"):
        errors.plot(
            arrays["time_s"], arrays["position_m"][:, axis], color=_COLOURS[axis], label=name
        )
    errors.legend(frameon=False, fontsize=9)
    errors.set_title("end-effector position error (m)", loc="left", fontsize=10, color=_INK)
    swing.plot(arrays["time_s"], np.degrees(arrays["swing_rad"]), color=_COLOURS[0])
    sigma_deg = math.degrees(SIGMA_RAD)
    for bound in (-sigma_deg, sigma_deg):
        swing.axhline(bound, color=_COLOURS[1], linewidth=1.0, linestyle="--")
    swing.set_title("swing φ (°) and ±σ", loc="left", fontsize=10, color=_INK)
    for axes in (errors, swing):
        axes.set_xlabel("time (s)", fontsize=9, color=_INK)
        _clean(axes)
    return figure


FIGURES = (
    Illustration(name="figure_2", part="transport", draw=figure_2),
    Illustration(name="figure_3", part="transport", draw=figure_3),
    Illustration(name="figure_4", part="transport", draw=figure_4),
    Illustration(name="figure_5", part="transport", draw=figure_5),
    Illustration(name="damping_study", part="damping_study", draw=damping_figure),
    Illustration(name="l1", part="l1", draw=l1_figure),
)


def _course(axes: Axes, course: Course, column: int, colour: str, label: str = "") -> None:
    """Draw a column as a band between its extremes and a line through its samples."""
    hours = course.time_s / _SECONDS_PER_HOUR
    low, high = course.low[:, column], course.high[:, column]
    axes.fill_between(hours, low, high, color=colour, linewidth=0.0, alpha=0.5)
    times = np.concatenate(([0.0], hours))
    values = np.concatenate(([course.opening[0, column]], 0.5 * (low + high)))
    axes.plot(times, values, color=colour, linewidth=1.3, label=label)


def _clean(axes: Axes) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8, color="#999999", labelcolor=_INK)
