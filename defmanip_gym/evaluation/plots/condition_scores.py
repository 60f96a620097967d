"""Success and score under each condition of a suite, for the contestants that matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure

from defmanip_gym.evaluation.plots.panel import (
    FAINT,
    Colours,
    legend_below,
    legend_height_in,
    panel,
    title,
)
from defmanip_gym.evaluation.statistics.condition_estimates import (
    score_under_conditions,
    success_under_conditions,
)
from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable
from defmanip_gym.evaluation.statistics.intervals import Estimate

_ROW_IN, _SPREAD = 0.13, 0.7


def plot_success_by_condition(tables: Sequence[EpisodeTable], colours: Colours) -> Figure:
    """Draw success rates with their intervals."""
    return _plot(tables, colours, success_under_conditions, "Success by condition", "success rate")


def plot_score_by_condition(tables: Sequence[EpisodeTable], colours: Colours) -> Figure:
    """Draw interquartile means of the score with their intervals."""
    return _plot(tables, colours, score_under_conditions, "Score by condition", "score, IQM")


def _plot(
    tables: Sequence[EpisodeTable],
    colours: Colours,
    estimates: Callable[[EpisodeTable], dict[str, Estimate]],
    heading: str,
    label: str,
) -> Figure:
    conditions = list(dict.fromkeys(tables[0].conditions))[::-1]  # the first on top
    names = [table.contestant for table in tables]
    legend_in = legend_height_in(names)
    rows_in = _ROW_IN * len(conditions) * (len(tables) + 0.8)
    figure, axes = panel(0.75 + rows_in + legend_in, left=1.25, bottom=0.45 + legend_in)
    offsets = np.linspace(_SPREAD / 2, -_SPREAD / 2, len(tables)) if len(tables) > 1 else (0.0,)
    for table, offset in zip(tables, offsets, strict=True):
        under, colour = estimates(table), colours[table.contestant]
        for row, condition in enumerate(conditions):
            estimate = under[condition]
            if estimate.interval is not None:
                axes.plot(estimate.interval, [row + offset] * 2, color=colour, linewidth=1.5)
            axes.plot(estimate.value, row + offset, "o", color=colour, markersize=4)
    for row in range(len(conditions) - 1):
        axes.axhline(row + 0.5, color=FAINT, linewidth=0.6)
    axes.set_yticks(range(len(conditions)), conditions, fontsize=8)
    axes.set_ylim(-0.5, len(conditions) - 0.5)
    axes.set_xlim(left=0.0)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(label)
    title(axes, heading)
    legend_below(figure, names, colours)
    return figure
