"""All contestants' scores with their intervals, one under the other."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from defmanip_gym.evaluation.plots.panel import FAINT, INK, Colours, panel, title
from defmanip_gym.evaluation.statistics.intervals import CONFIDENCE
from defmanip_gym.evaluation.statistics.summary import Summary

_ROW_IN = 0.21
_CHARACTER_IN, _FONT_PT = 0.062, 7.5  # of names
_WIDEST_IN = 2.1


def plot_forest(summaries: Sequence[Summary], colours: Colours) -> Figure:
    """Draw the interquartile mean of the score of each contestant, the highest on top."""
    ordered = sorted(summaries, key=lambda summary: summary.score["iqm"].value)
    longest = max(len(summary.contestant) for summary in ordered)
    left = min(0.2 + _CHARACTER_IN * longest, _WIDEST_IN)
    font = _FONT_PT * min(1.0, (left - 0.1) / (_CHARACTER_IN * longest))
    figure, axes = panel(0.9 + _ROW_IN * len(ordered), left=left)
    for row, summary in enumerate(ordered):
        estimate, colour = summary.score["iqm"], colours[summary.contestant]
        if estimate.interval is not None:
            axes.plot(estimate.interval, (row, row), color=colour, linewidth=2.0)
        axes.plot(estimate.value, row, "o", color=colour, markersize=5)
    names = [summary.contestant for summary in ordered]
    axes.set_yticks(range(len(ordered)), names, fontsize=font)
    axes.set_ylim(-0.6, len(ordered) - 0.4)
    axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
    axes.grid(axis="x", color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(f"score, {100 * CONFIDENCE:.0f} % intervals")
    title(axes, "Score, IQM", colour=INK)
    return figure
