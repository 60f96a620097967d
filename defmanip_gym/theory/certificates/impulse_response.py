"""Time integrals of impulse responses: peak-to-peak gains of stable linear systems."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from defmanip_gym.theory.dynamics.chain import Array

_SAMPLES_PER_PERIOD = 200
_DECAYS_OF_A_MODE = 16.0  # a mode counts until it has shrunk by e⁻¹⁶
_BLOCK = 1024


def peak_gains(
    A: Array, B: Array, C: Array, *, samples_per_period: int = _SAMPLES_PER_PERIOD
) -> Array:
    """Return ∫₀^∞ |C e^{At} B| dt elementwise: the exact peak-to-peak gains.

    |y_i(t)| ≤ Σ_j gain_ij · sup|u_j| for η̇ = A η + B u, y = C η from rest, and a bang-bang input
    attains it. A trapezoidal sum falls short by (ω T)²/12 on a sine; rounded up by that much at the
    fastest mode, so that bounds made of it stay bounds.

    Args:
        A: (k, k), Hurwitz.
        B: (k, inputs).
        C: (outputs, k).
        samples_per_period: of the fastest mode; fewer are faster and round up more.

    Returns:
        (outputs, inputs).
    """
    total = np.zeros((C.shape[0], B.shape[1]))
    for period, response in _sampled_response(A, B, C, samples_per_period):
        magnitude = np.abs(response)
        total += period * (magnitude.sum(axis=0) - 0.5 * (magnitude[0] + magnitude[-1]))
    return total * (1 + (2 * np.pi / samples_per_period) ** 2 / 12)


def peak_free_response(A: Array, starts: Array, C: Array) -> Array:
    """Return sup_t Σ_j |C e^{At} s_j| over the columns s_j, shape (outputs,); β in Eq. (15).

    That is the largest |C η(t)| over all initial states Σ_j r_j s_j with |r_j| ≤ 1.

    Args:
        A: (k, k), Hurwitz.
        starts: (k, columns); zero columns are skipped.
        C: (outputs, k).
    """
    peak = np.zeros(C.shape[0])
    used = np.flatnonzero(np.abs(starts).max(axis=0))
    if not len(used):
        return peak
    for _, response in _sampled_response(A, starts[:, used], C, _SAMPLES_PER_PERIOD):
        peak = np.maximum(peak, np.abs(response).sum(axis=-1).max(axis=0))
    # a peak between two samples rises by (ωT/2)²/2 at most
    return peak * (1 + (np.pi / _SAMPLES_PER_PERIOD) ** 2 / 2)


def _sampled_response(
    A: Array, B: Array, C: Array, samples_per_period: int
) -> Iterator[tuple[float, Array]]:
    """Yield sampling periods and blocks of C e^{At} B that join end to end.

    The period follows the fastest mode that is still alive, so that a stiff object's quickly
    damped vibrations do not dictate the sampling of its slow swing.
    """
    begin, state = 0.0, B
    for end, speed in _stages(np.linalg.eigvals(A)):
        longest = 2 * np.pi / speed / samples_per_period
        blocks = max(1, int(np.ceil((end - begin) / longest / _BLOCK)))
        period = (end - begin) / (blocks * _BLOCK)
        outputs = C @ _powers(expm(A * period), _BLOCK + 1)
        across_block = expm(A * period * _BLOCK)
        for _ in range(blocks):
            yield period, outputs @ state
            state = across_block @ state
        begin = end


def _stages(eigenvalues: NDArray[Any]) -> list[tuple[float, float]]:
    """Return (end time, fastest |λ| alive until then) in order of time."""
    lifetimes = _DECAYS_OF_A_MODE / -eigenvalues.real
    return [
        (float(end), float(np.abs(eigenvalues[lifetimes >= end]).max()))
        for end in np.unique(lifetimes)
    ]


def _powers(matrix: Array, count: int) -> Array:
    """Return matrix⁰ … matrix^(count−1), shape (count, k, k)."""
    powers = np.empty((count, *matrix.shape))
    powers[0] = np.eye(matrix.shape[0])
    filled, jump = 1, matrix
    while filled < count:
        size = min(filled, count - filled)
        powers[filled : filled + size] = powers[:size] @ jump
        filled, jump = filled + size, jump @ jump
    return powers
