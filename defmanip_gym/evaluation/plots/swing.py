"""The swing over time against ±σ."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from defmanip_gym.evaluation.plots.panel import BAND, BOUND, panel, title
from defmanip_gym.evaluation.traces import Trace

_SHORTEST_AXIS_S = 2.0
_CUT = 1.5  # swings beyond this many σ are cut off


def sigma_rad(trace: Trace) -> float:
    """Return σ of a trace's episode."""
    return float(trace.margin_rad[0] + trace.largest_swing_rad[0])


def plot_swing(traces: Sequence[Trace], colour: str) -> Figure:
    """Draw a contestant's swing in its traced episodes, the first of them strong."""
    figure, axes = panel(1.85)
    sigma = sigma_rad(traces[0])
    axes.axhspan(-1.0, 1.0, color=BAND, zorder=0)
    for bound in (-1.0, 1.0):
        axes.axhline(bound, color=BOUND, linewidth=0.8, linestyle="--", zorder=1)
    for index, trace in reversed(list(enumerate(traces))):
        width, alpha = (1.3, 1.0) if index == 0 else (0.8, 0.4)
        share = trace.swing_rad / sigma
        axes.plot(trace.time_s, share, color=colour, linewidth=width, alpha=alpha)
        end = np.full(share.shape[1], trace.time_s[-1])
        axes.plot(end, share[-1], "o", color=colour, markersize=3, alpha=alpha)
    largest = max(float(trace.largest_swing_rad.max()) for trace in traces) / sigma
    duration = max(_SHORTEST_AXIS_S, *(float(trace.time_s[-1]) for trace in traces))
    axes.set_xlim(0.0, 1.02 * duration)
    axes.set_ylim(-_CUT, _CUT)
    axes.set_yticks((-1.0, 0.0, 1.0), ("−σ", "0", "+σ"))
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"swing φ, σ = {math.degrees(sigma):.0f}°")
    title(axes, traces[0].contestant, colour=colour, note=f"max {largest:.2f} σ")
    return figure
