"""One hinge in the phase plane: what a bound reaches, what filters keep, what is viable."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from defmanip_gym.certification.ladder import Ladder
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.phase_plane import one_hinge_reachable_set
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.viability import viable_set

Edge = tuple[Array, Array]

_INK, _BOUND = "#333333", "#2f6db3"
# one for each filter that has a set, in the order of the family
_COLOURS = ("#12806a", "#b8860b", "#7a4fa3", "#5a6e2e")


def has_phase_plane(ladder: Ladder) -> bool:
    """Whether any set of the ladder can be drawn."""
    return any(line.edge is not None for line in ladder.filters)


def draw_phase(axes: Axes, ladder: Ladder) -> None:
    """Draw the sets, the largest behind."""
    for sign in (-1.0, 1.0):
        label = "±σ" if sign > 0 else None
        axes.axvline(sign, color=_INK, linewidth=0.9, linestyle="--", label=label)
    sets = [
        (f"kept by {line.name}, up to {line.largest_m_s2:g} m/s²", line.edge, colour)
        for line, colour in zip(ladder.filters, _COLOURS, strict=False)
        if line.edge is not None
    ]
    reached = _reached(ladder)
    if reached is not None and ladder.tightest is not None:
        bound = ladder.tightest.acceleration_bound
        label = f"reached within {ladder.tightest.method}, up to {bound:.3g} m/s²"
        sets.append((label, reached, _BOUND))
    for label, edge, colour in sorted(sets, key=lambda each: _area(each[1]), reverse=True):
        _fill(axes, edge, ladder.sigma, colour, label)
    most = _viable(ladder)
    if most is not None:
        angles, rates = (np.concatenate((half, -half, half[:1])) for half in most)
        label = "viable from rest by forward acceleration alone"
        axes.plot(angles / ladder.sigma, rates, color=_INK, linewidth=0.9, label=label)
    axes.set_xlabel("swing φ / σ")
    axes.set_ylabel("swing rate φ̇ (rad/s)")
    axes.set_xlim(-1.25, 1.25)
    axes.legend(fontsize="small", loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)


def _viable(ladder: Ladder) -> Edge | None:
    """Return the edge of what a resting grasp can keep within σ going forth; None if not known."""
    if ladder.beam is None:
        return None
    try:
        viable = viable_set(ladder.beam, sigma_rad=ladder.sigma)
    except ParameterError:  # swings too fast or too slow for the control period
        return None
    at_rest = int(np.argmin(np.abs(viable.speed)))
    return viable.swing, viable.inner[:, at_rest]


def _area(edge: Edge) -> float:
    return float(np.trapezoid(edge[1], edge[0]))


def _fill(axes: Axes, edge: Edge, sigma: float, colour: str, label: str) -> None:
    angles, rates = (np.concatenate((half, -half)) for half in edge)
    axes.fill(angles / sigma, rates, facecolor=f"{colour}22", edgecolor=colour, label=label)


def _reached(ladder: Ladder) -> Edge | None:
    """Return the edge of what the tightest bound lets happen; None where that is not known."""
    certificate = ladder.tightest
    if certificate is None or not isinstance(certificate.deformable, BeamParams):
        return None
    return one_hinge_reachable_set(
        certificate.deformable,
        certificate.resulting_acceleration,
        certificate.sigma_rad,
        certificate.conditions,
        certificate.intervals,
    )
