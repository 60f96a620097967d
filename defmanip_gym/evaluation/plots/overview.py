"""The answer as a picture: the best analytic and the best learned contestant of every suite."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from defmanip_gym.evaluation.plots.panel import FAINT, INK, SOFT, panel, title
from defmanip_gym.evaluation.statistics.intervals import CONFIDENCE
from defmanip_gym.evaluation.statistics.summary import Summary

ANALYTIC, LEARNED = "#2b6ca3", "#c2571a"
_ROW_IN = 0.72
_APART = 0.22  # the two of a suite from its middle
_ABOVE = 0.05  # names above their lines


class Best(NamedTuple):
    """The two of a suite that score highest of their kinds."""

    suite: str
    analytic: Summary
    learned: Summary


def plot_overview(suites: Sequence[Best]) -> Figure:
    """Draw the interquartile means of the score of each suite's two, first suite on top."""
    figure, axes = panel(0.9 + _ROW_IN * len(suites), left=0.85)
    ends = [0.0]
    for row, best in enumerate(reversed(suites)):
        for summary, colour, offset in (
            (best.analytic, ANALYTIC, _APART),
            (best.learned, LEARNED, -_APART),
        ):
            estimate, level = summary.score["iqm"], row + offset
            interval = estimate.interval or (estimate.value, estimate.value)
            axes.plot(interval, (level, level), color=colour, linewidth=2.2)
            axes.plot(estimate.value, level, "o", color=colour, markersize=5.5)
            name = summary.contestant
            axes.text(0.01, level + _ABOVE, name, fontsize=7, va="bottom", color=colour)
            ends.append(interval[1])
    axes.set_yticks(range(len(suites)), [best.suite for best in reversed(suites)])
    axes.set_ylim(-0.55, len(suites) - 0.45)
    axes.set_xlim(0.0, 1.05 * max(*ends, 0.1))
    axes.grid(axis="x", color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(f"score, {100 * CONFIDENCE:.0f} % intervals", color=SOFT)
    title(axes, "Best analytic, best learned", colour=INK)
    return figure
