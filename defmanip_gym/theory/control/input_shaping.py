"""Zero-vibration-and-derivative input shaping of a swing.

A command convolved with three impulses, half a period of the damped swing apart, leaves none of
that swing behind, and little where the frequency is a little wrong: N. C. Singer, W. P. Seering,
"Preshaping command inputs to reduce system vibration", J. Dyn. Sys., Meas., Control 112 (1990).
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from defmanip_gym.errors import GainError
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject

# impulses beyond the first: ZV has one, ZVD two, ZVDD three
ShaperKind = Literal["zv", "zvd", "zvdd"]
_FURTHER_IMPULSES: dict[str, int] = {"zv": 1, "zvd": 2, "zvdd": 3}


def slowest_swing(linear: LinearizedObject) -> tuple[float, float]:
    """Return the natural frequency (rad/s) and the damping ratio of the slowest oscillation.

    Raises:
        GainError: nothing oscillates, so there is nothing to shape.
    """
    modes = [pole for pole in np.linalg.eigvals(linear.A_u) if pole.imag > 0]
    if not modes:
        raise GainError(
            "damping of the object", linear.d_o22.tolist(), "an object that oscillates",
            "Use another controller: what creeps back needs no shaping.",
        )  # fmt: skip
    slowest = min(modes, key=abs)
    return float(abs(slowest)), float(-slowest.real / abs(slowest))


def shaper(
    frequency_rad_s: float, damping_ratio: float, period_s: float, kind: ShaperKind = "zvd"
) -> Array:
    """Return the weights of a sampled command and its past, newest first, (K,), summing to 1.

    Impulse i of n + 1 has the weight binom(n, i) κⁱ / (1 + κ)ⁿ at i half periods, with
    κ = exp(−π ζ / √(1 − ζ²)). Impulses between two samples are shared among them.

    Args:
        frequency_rad_s: natural frequency of the swing.
        damping_ratio: ζ in [0, 1).
        period_s: of the samples.
        kind: how many derivatives after the frequency vanish.
    """
    n, root = _FURTHER_IMPULSES[kind], math.sqrt(1.0 - damping_ratio**2)
    half_period = math.pi / (frequency_rad_s * root) / period_s
    kappa = math.exp(-math.pi * damping_ratio / root)
    weights = np.zeros(math.floor(n * half_period) + 2)
    for i in range(n + 1):
        sample, rest = divmod(i * half_period, 1.0)
        size = math.comb(n, i) * kappa**i / (1.0 + kappa) ** n
        weights[int(sample)] += (1.0 - rest) * size
        weights[int(sample) + 1] += rest * size
    return weights
