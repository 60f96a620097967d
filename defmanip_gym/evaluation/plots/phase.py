"""Swing against swing rate, and the set that a safety filter keeps them in."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from defmanip_gym.evaluation.conditions import NOMINAL
from defmanip_gym.evaluation.plots.panel import BAND, BOUND, FAINT, panel, title
from defmanip_gym.evaluation.plots.swing import sigma_rad
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.evaluation.traces import Trace
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.certificates.phase_plane import one_hinge_reachable_set
from defmanip_gym.theory.filters.storage_filter import StorageFilter

Edge = tuple[NDArray[np.float64], NDArray[np.float64]]

_CUT = 1.5


def kept_set(protection: Protection) -> Edge | None:
    """Return the upper edge of what a filter keeps the nominal beam in; None if not known."""
    if protection.certificate is not None:
        return reachable_set(protection.certificate)
    made = protection.filter_for(NOMINAL)
    return made.edge() if isinstance(made, StorageFilter) else None


def reachable_set(certificate: Certificate) -> Edge | None:
    """Return the upper edge of what a certificate lets happen; None where that is not known."""
    beam = certificate.deformable
    if not isinstance(beam, BeamParams) or beam.segment_count != 1:
        return None
    return one_hinge_reachable_set(
        beam,
        certificate.resulting_acceleration,
        certificate.sigma_rad,
        certificate.conditions,
        certificate.intervals,
    )


def plot_phase(
    traces: Sequence[Trace],
    colour: str,
    *,
    edge: Edge | None,
    is_enforced: bool,
    uncovered: Collection[str] = (),
) -> Figure:
    """Draw the first segment's φ and φ̇ in a contestant's traced episodes.

    Args:
        traces: of one contestant.
        colour: its colour.
        edge: of the set that a filter keeps.
        is_enforced: whether that filter is around this contestant.
        uncovered: scenarios whose plant the filter does not cover; drawn dotted.
    """
    figure, axes = panel(2.35)
    sigma = sigma_rad(traces[0])
    for bound in (-1.0, 1.0):
        axes.axvline(bound, color=BOUND, linewidth=0.8, linestyle="--", zorder=1)
    if edge is not None:
        angles = np.concatenate((edge[0], -edge[0])) / sigma
        rates = np.concatenate((edge[1], -edge[1]))
        if is_enforced:
            axes.fill(angles, rates, facecolor=BAND, edgecolor=BOUND, linewidth=1.0, zorder=0)
        else:
            axes.fill(angles, rates, facecolor="none", edgecolor=FAINT, linewidth=1.0, zorder=0)
    for index, trace in reversed(list(enumerate(traces))):
        width, alpha = (1.2, 1.0) if index == 0 else (0.7, 0.45)
        style = ":" if trace.scenario in uncovered else "-"
        phi, rate = trace.swing_rad[:, 0] / sigma, trace.swing_rate_rad_s[:, 0]
        axes.plot(phi, rate, color=colour, linewidth=width, alpha=alpha, linestyle=style)
    largest = max(float(np.abs(trace.swing_rate_rad_s[:, 0]).max()) for trace in traces)
    highest = max(largest, 0.0 if edge is None else float(edge[1].max()))
    axes.set_xlim(-_CUT, _CUT)
    axes.set_ylim(-1.1 * highest, 1.1 * highest)
    axes.set_xticks((-1.0, 0.0, 1.0), ("−σ", "0", "+σ"))
    axes.set_xlabel("swing φ")
    axes.set_ylabel("swing rate φ̇ (rad/s)")
    title(axes, traces[0].contestant, colour=colour)
    return figure
