"""Gains for the object at hand: the wished ones, weakened until the sampled loop has a margin.

The lighter the part at the grasp, the more a wrong damping in the force law is taken for an
acceleration (``effective_damping``): the slowest swing of sixteen segments gets 560 times of the
error, that of one rod 3 times. So the search does not set the assumed damping d̂ but how much it
adds to the slowest swing, and the loop has to be stable for all dampings that the object may have.
Sampling bounds k1, k2 and the tracking from above.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.linalg import eigh

from defmanip_gym.errors import GainError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.disk_margin import DiskMargin, disk_margin
from defmanip_gym.theory.control.effective_damping import force_tracking_gain
from defmanip_gym.theory.control.stability import SampledLoop
from defmanip_gym.theory.payload.zero_dynamics import linearize
from defmanip_gym.validation import require_between

# Shares of what is wished for.
_TRACKING_SHARES = (1.0, 0.7, 0.5, 0.3)
_FORCE_LOOP_SHARES = (1.0, 0.7, 0.5, 0.3, 0.15, 0.05, 0.015, 0.005)
_ADDED_SHARES = (1.0, 0.5, 0.25, 0.0)
_LARGEST_MARGIN = 2.0


def slowest_swing(beam: BeamParams) -> tuple[float, float, float]:
    """Return of a beam's slowest mode what the force law's damping error adds to its damping ratio.

    Returns:
        Damping ratio per N·m·s/rad that the force law assumes too little, the mode's own damping
        ratio, and its frequency in rad/s.
    """
    linear = linearize(beam)
    squares, modes = eigh(linear.k_o22 + linear.gravity_stiffness, linear.m_o22)
    frequency, mode = float(np.sqrt(squares[0])), modes[:, 0]  # vᵀ m_o22 v = 1
    added = (mode @ force_tracking_gain(linear)[:, 0]) * mode[0]
    return (
        float(added / (2 * frequency)),
        float(mode @ linear.d_o22 @ mode / (2 * frequency)),
        frequency,
    )


def loop_with_margin(
    wished: SampledLoop,
    *,
    added_ratio: float,
    margin: float,
    damping_factors: tuple[float, float],
) -> SampledLoop:
    """Return a loop with the margin, as near to the wished one as a coarse search comes.

    Tracking gain and approach rate are the last to be lowered, each pair in proportion, k1 and k2
    the next, and what the force law adds to the slowest swing's damping the first.

    Args:
        wished: with the gains that would be wished for; its damping in the force law is ignored.
        added_ratio: damping ratio that the force law would be wished to add; d̂ = 0 adds 0.081 to
            the reference beam.
        margin: least disk margin, in (0, 2).
        damping_factors: least and largest damping of the object's root, as multiples of the known
            one, with which the loop must be stable, too.

    Raises:
        GainError: no gains have the margin; it says what limits it.
    """
    margin = require_between("margin", margin, 0.0, _LARGEST_MARGIN)
    best = DiskMargin(0.0, 0.0)
    for candidate in _candidates(wished, added_ratio):
        found = disk_margin(candidate)
        if found.margin >= margin and _is_stable(candidate, damping_factors):
            return candidate
        best = max(best, found)
    raise GainError(
        "margin",
        margin,
        f"gains that have it; here {_limit(best, wished, margin, damping_factors)}",
        "Ask for less, or change what limits it.",
    )


def _is_stable(loop: SampledLoop, damping_factors: tuple[float, float]) -> bool:
    """Whether the loop is stable with other dampings than its controller believes."""
    beam = loop.beam
    others = (replace(beam, damping=factor * beam.damping) for factor in damping_factors)
    return all(replace(loop, beam=other).spectral_radius() < 1.0 for other in others)


def _candidates(wished: SampledLoop, added_ratio: float) -> Iterator[SampledLoop]:
    per_damping, _, _ = slowest_swing(wished.beam)
    for tracking, force, added in product(_TRACKING_SHARES, _FORCE_LOOP_SHARES, _ADDED_SHARES):
        gains = ForceLoopGains(k1=force * wished.gains.k1, k2=force * wished.gains.k2)
        yield replace(
            wished,
            gains=gains,
            force_law_damping=wished.beam.damping - added * added_ratio / per_damping,
            tracking_gain=tracking * wished.tracking_gain,
            approach_rate=tracking * wished.approach_rate,
        )


def _limit(
    best: DiskMargin,
    wished: SampledLoop,
    margin: float,
    damping_factors: tuple[float, float],
) -> str:
    """Return what binds, by the loop with the largest margin."""
    _, ratio, swing_rad_s = slowest_swing(wished.beam)
    swing = f"the object's swing, with a damping ratio of its own of {ratio:.3g}"
    sampling = f"sampling, with a period of {wished.period_s:g} s"
    if best.margin == 0.0:
        return f"no loop is stable: too much for {swing}, and {sampling}"
    if best.margin >= margin:
        return f"none is stable for {damping_factors} of the damping: know it better"
    binding = swing if best.frequency_rad_s < 2.0 * swing_rad_s else sampling
    return f"{best.margin:.3g} is the largest, at {best.frequency_rad_s:.3g} rad/s: {binding}"
