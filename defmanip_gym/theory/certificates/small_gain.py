"""One acceleration bound for a whole box of parameters, lifting and turning: small gain.

What is not the linear object at the middle of the box enters it as a torque of known size per unit
of deformation, whatever its time course. With p the peaks of its modes and their rates over any
finite time,

    p ≤ β + g ā + Θ p   hence   p ≤ (I − Θ)⁻¹ (β + g ā)   where the spectral radius of Θ is below 1.

A stiffness that is constant, though unknown, mostly changes how fast the object moves, and peaks do
not depend on the scale of time. So time is scaled such that the slowest mode keeps its frequency;
only what remains enters Θ (docs/derivations.md, section 5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import eigh

from defmanip_gym.theory.certificates.conditions import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.certificates.impulse_response import peak_free_response, peak_gains
from defmanip_gym.theory.certificates.peak_bounds import horizontal_inputs
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, is_hurwitz

_BISECTIONS = 40
_COARSE = 64  # samples per period where an error of a thousandth does no harm

PeakBound = Callable[[LinearizedObject], Array]


@dataclass(frozen=True, kw_only=True)
class PeakInequality:
    """p ≤ β + g ā + (Θ + ā Θ_a) p for 2N modal peaks; the same, without p, for the N coordinates.

    The first 2N rows are modes and their rates, the last N the coordinates z2 − z2*.

    Attributes:
        free: β, (3N,), from the initial state and from lifting at a bent equilibrium.
        gain: g, (3N,), per m/s² of horizontal acceleration.
        loops: the parts of Θ, (3N, 2N) each, by what they come from.
        input_loop: Θ_a, (3N, 2N), stiffness that the horizontal acceleration itself brings.
        damping_cost: what not knowing the damping adds, roughly, as a loop gain.
        stiffness_cost: the same for the stiffness.
    """

    free: Array
    gain: Array
    loops: Mapping[str, Array]
    input_loop: Array
    damping_cost: float
    stiffness_cost: float

    def acceleration_bound(self, budget: Array) -> float:
        """Return the largest ā that keeps the coordinates within ``budget``; 0 if there is none.

        Args:
            budget: (N,), largest |z2 − z2*|.
        """
        loop = sum(self.loops.values(), np.zeros_like(self.input_loop))
        limit = self._bound_with(loop, budget)
        if not self.input_loop.any() or limit == 0:
            return limit
        # ā is within the bound that its own loop leaves; both sides are monotone
        safe = 0.0
        for _ in range(_BISECTIONS):
            trial = (safe + limit) / 2
            holds = self._bound_with(loop + trial * self.input_loop, budget) >= trial
            safe, limit = (trial, limit) if holds else (safe, trial)
        return safe

    def _bound_with(self, loop: Array, budget: Array) -> float:
        modal = 2 * len(budget)
        closing, outward = loop[:modal], loop[modal:]
        if closing.any() and np.abs(np.linalg.eigvals(closing)).max() >= 1:
            return 0.0
        sources = np.stack((self.free, self.gain), axis=1)
        peaks = np.linalg.solve(np.eye(modal) - closing, sources[:modal])
        free, gain = (sources[modal:] + outward @ peaks).T
        if (free > budget).any():
            return 0.0
        moved = gain > 0
        return float(((budget - free)[moved] / gain[moved]).min(initial=np.inf))


def peak_inequality(
    linear: LinearizedObject,
    box: ParameterIntervals,
    conditions: CertificateConditions,
    bound: PeakBound,
) -> PeakInequality | None:
    """Return the inequality that holds for every object in the box; None if its middle is unstable.

    Args:
        linear: the object that the factors of ``box`` multiply.
        box: factors on damping and stiffness.
        conditions: limits of the motion and of the initial state.
        bound: gain of the horizontal acceleration, from ``peak_bounds``.
    """
    scaling = _TimeScaling.of(linear, box)
    middle = linear.scaled(damping=scaling.damping, stiffness=scaling.stiffness)
    if not is_hurwitz(middle.A_u):
        return None
    count, slowest = linear.count, scaling.slowest
    _, modes = eigh(middle.k_o22 + middle.gravity_stiffness, linear.m_o22)
    into_modes = np.linalg.inv(modes)
    nothing = np.zeros((count, count))
    C = np.block([[into_modes, nothing], [nothing, into_modes], [np.eye(count), nothing]])

    @cache
    def per_modal_force() -> Array:
        return _force_gains(middle, linear.m_o22 @ modes, C)

    def loop(torques: Array, *, on_rates: bool = False) -> Array:
        """Return what torques (N, N) per unit of the coordinates, or of their rates, close."""
        if not torques.any():
            return np.zeros((3 * count, 2 * count))
        sizes = per_modal_force() @ np.abs(modes.T @ torques @ modes)
        idle = np.zeros_like(sizes)
        return np.hstack((idle, sizes) if on_rates else (sizes / slowest, idle))

    lifting = conditions.vertical_acceleration_m_s2
    free = peak_free_response(middle.A_u, _starts(conditions, count, slowest), C)
    if lifting > 0:
        push = -lifting * linear.m_o12[2][:, None]
        free = free + _force_gains(middle, push, C)[:, 0] / slowest
    gain = peak_gains(middle.A_u, horizontal_inputs(middle), C).sum(axis=1)
    gain[2 * count :] = bound(middle)[:count]
    damping_loop = loop(scaling.damping_margin * linear.d_o22, on_rates=True)
    residual_loop = loop(scaling.residual_stiffness)
    return PeakInequality(
        free=free,
        gain=gain / slowest,
        loops={
            "damping": damping_loop,
            "stiffness": residual_loop,
            "lifting": loop(lifting * linear.vertical_stiffness),
            "turning": loop(conditions.yaw_rate_rad_s**2 * linear.centrifugal_stiffness),
        },
        input_loop=sum(map(loop, linear.horizontal_stiffness), np.zeros_like(loop(nothing))),
        damping_cost=scaling.damping_share * float(damping_loop.max()),
        stiffness_cost=(1 - scaling.damping_share) * float(damping_loop.max())
        + float(residual_loop.max())
        + (1 / slowest - 1),
    )


def _force_gains(linear: LinearizedObject, forces: Array, C: Array) -> Array:
    """Return the peak gains (outputs, k) of forces on z2, one per column of (N, k)."""
    direct = linear.torque_input(forces)
    inputs = np.vstack((np.zeros_like(direct), direct))
    return peak_gains(linear.A_u, inputs, C, samples_per_period=_COARSE)


def _starts(conditions: CertificateConditions, count: int, slowest: float) -> Array:
    """Return the half-widths of the initial states as columns, (2N, 2N), rates in scaled time."""
    rate = conditions.initial_swing_rate_rad_s / np.sqrt(slowest)
    return np.diag(np.repeat((conditions.initial_swing_rad, rate), count))


@dataclass(frozen=True, kw_only=True)
class _TimeScaling:
    """A box seen in the time of its slowest mode.

    With K = c K_0 + R, c chosen so that R does nothing to the slowest mode, and τ = √c t, the
    object obeys M z'' + (D/√c) z' + K_0 z = (torques − R z) / c.

    Attributes:
        damping: factor at the middle of D/√c.
        damping_margin: half-width of that factor.
        stiffness: factor at the middle of the box.
        residual_stiffness: largest R, (N, N).
        slowest: smallest c.
        damping_share: share of ``damping_margin`` that the damping's own interval has.
    """

    damping: float
    damping_margin: float
    stiffness: float
    residual_stiffness: Array
    slowest: float
    damping_share: float

    @classmethod
    def of(cls, linear: LinearizedObject, box: ParameterIntervals) -> _TimeScaling:
        """Return the scaling for a box of factors."""
        stiffness, margin = float(np.mean(box.stiffness)), float(np.ptp(box.stiffness) / 2)
        total = stiffness * linear.k_o22 + linear.gravity_stiffness
        values, modes = eigh(total, linear.m_o22)
        share = float(modes[:, 0] @ linear.k_o22 @ modes[:, 0] / values[0])
        slowest, fastest = 1 - margin * share, 1 + margin * share
        low, high = box.damping[0] / np.sqrt(fastest), box.damping[1] / np.sqrt(slowest)
        own = float(np.ptp(box.damping))
        return cls(
            damping_share=min(own / float(high - low), 1.0) if own > 0 else 0.0,
            damping=float(low + high) / 2,
            damping_margin=float(high - low) / 2,
            stiffness=stiffness,
            residual_stiffness=margin * (linear.k_o22 - share * total),
            slowest=slowest,
        )
