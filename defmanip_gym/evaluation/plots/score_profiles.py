"""Performance profiles of the contestants that matter."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from defmanip_gym.evaluation.plots.panel import (
    FAINT,
    Colours,
    legend_below,
    legend_height_in,
    panel,
    title,
)
from defmanip_gym.evaluation.statistics.profiles import Profile


def plot_profiles(profiles: Mapping[str, Profile], colours: Colours) -> Figure:
    """Draw the share of episodes above each score, with pointwise bands."""
    names = list(profiles)
    figure, axes = panel(2.6 + legend_height_in(names), bottom=0.45 + legend_height_in(names))
    for name, profile in profiles.items():
        axes.fill_between(
            profile.thresholds, profile.low, profile.high, color=colours[name], alpha=0.18, lw=0
        )
        axes.plot(profile.thresholds, profile.shares, color=colours[name], linewidth=1.6)
    axes.set_ylim(-0.02, 1.03)
    axes.margins(x=0.0)
    axes.grid(color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_xlabel("score τ")
    axes.set_ylabel("share of episodes above τ")
    title(axes, "Performance profiles", note="95 % bands")
    legend_below(figure, names, colours)
    return figure
