"""The ladder as a picture: bounds on a logarithmic axis, sets of one hinge, the attack."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from defmanip_gym.attack.result import AttackResult
from defmanip_gym.certification.ladder import Ladder
from defmanip_gym.certification.phase_plot import draw_phase, has_phase_plane
from defmanip_gym.certification.table import PROOFS
from defmanip_gym.display import save_figure
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.dynamics.chain import Array

_COLOURS = {"nonlinear": "#1b7f4d", "linear": "#2f6db3", "none": "#b9b9b9"}
_INK, _RED = "#333333", "#c0392b"


def save_plot(path: Path, ladder: Ladder) -> None:
    """Write the picture as PNG."""
    panels: list[Callable[[Axes], None]] = []
    if ladder.certificates or not has_phase_plane(ladder):
        panels.append(lambda axes: _draw_bounds(axes, ladder))
    if has_phase_plane(ladder):
        panels.append(lambda axes: draw_phase(axes, ladder))
    attack, tightest = ladder.attack, ladder.tightest
    if attack is not None and tightest is not None and _has_trajectory(attack):
        panels.append(lambda axes: _draw_attack(axes, ladder, attack, tightest))
    figure = Figure(figsize=(8.0, 3.4 * len(panels)), layout="constrained")
    for axes, draw in zip(np.atleast_1d(figure.subplots(len(panels), 1)), panels, strict=True):
        draw(axes)
    save_figure(path, figure)


def _has_trajectory(attack: AttackResult) -> bool:
    return math.isfinite(attack.violating_bound)


def _draw_bounds(axes: Axes, ladder: Ladder) -> None:
    methods = list(ladder.certificates)
    if not methods:
        axes.text(0.5, 0.5, "no bound holds for ever", transform=axes.transAxes, ha="center")
    for row, method in enumerate(methods):
        certificate = ladder.certificates[method]
        bound = certificate.acceleration_bound
        is_broken = ladder.is_broken(certificate)
        marker, colour = ("X", _RED) if is_broken else ("o", _COLOURS[certificate.proof])
        axes.plot([bound], [row], marker, markersize=9, color=colour)
        axes.annotate(
            f"{bound:.3g}", (bound, row), xytext=(0, 9), textcoords="offset points", ha="center"
        )
    for proof, colour in _COLOURS.items():
        axes.plot([], [], "o", color=colour, label=f"proven for {PROOFS[proof]}")
    if ladder.attack is not None and _has_trajectory(ladder.attack):
        axes.axvline(ladder.attack.violating_bound, color=_RED, label="broken by an attack")
    axes.set_xscale("log")
    axes.set_yticks(range(len(methods)), methods)
    axes.set_ylim(-0.6, len(methods) - 0.2)
    axes.set_xlabel("certified horizontal acceleration (m/s²)")
    axes.grid(axis="x", color="#e5e5e5")
    axes.set_axisbelow(True)
    axes.legend(
        fontsize="small", loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, columnspacing=1
    )


def _draw_attack(axes: Axes, ladder: Ladder, attack: AttackResult, tightest: Certificate) -> None:
    sigma, coordinate = attack.sigma, ladder.linear.coordinates.index(attack.coordinate)
    certified = tightest.resulting_acceleration / attack.limits.forward_m_s2
    time_s = attack.timestep_s * np.arange(1, len(attack.inputs) + 1)
    axes.axhspan(-sigma, sigma, color="#e8f3ec")
    for scale, colour, label in (
        (1.0, _RED, f"smallest bound broken, {attack.violating_bound:.3g} m/s²"),
        (certified, _COLOURS["linear"], f"same input at the {tightest.method} bound"),
    ):
        swing = _response(ladder, attack, scale)[:, coordinate]
        axes.plot(time_s, swing, color=colour, linewidth=1.1, label=label)
    for sign in (-1, 1):
        axes.axhline(sign * sigma, color=_INK, linewidth=0.8, linestyle="--")
    axes.set_xlim(0, time_s[-1])
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"{attack.coordinate} (rad)")
    axes.legend(fontsize="small", loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)


def _response(ladder: Ladder, attack: AttackResult, scale: float) -> Array:
    """Return z2 over time, (steps, N), under the attack with its horizontal inputs scaled."""
    rig = ObjectRig(ladder.target.varied(attack.plant).rig, count=1, num_threads=1)
    z2, z2_rate = np.split(attack.start, 2)
    rig.place(z2[None], z2_rate[None])
    factors = np.array([[scale, scale, 1.0, 1.0]])
    shaking = rig.play(attack.inputs[None], scale=factors, record=True)
    assert shaking.z2 is not None
    return shaking.z2[0]
