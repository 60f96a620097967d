"""How much the sampled loop bears: the disk margin at the grasp acceleration.

P. Seiler, A. Packard and P. Gahinet, "An introduction to disk margins", IEEE Control Systems
Magazine 40 (2020): of all errors of gain and phase at once, in a disk about one, the smallest that
the loop does not bear. A margin α bears gains from (2 − α)/(2 + α) to (2 + α)/(2 − α), or phases up
to 2 atan(α/2); 2 is the largest, that of no feedback at all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.theory.control.stability import SampledLoop

_SLOWEST = 1e-3  # of the frequencies looked at, as a share of the fastest
_FREQUENCIES = 200


class DiskMargin(NamedTuple):
    """The margin α, and the frequency at which the loop bears no more."""

    margin: float
    frequency_rad_s: float


def disk_margin(loop: SampledLoop) -> DiskMargin:
    """Return the disk margin of a loop, cut open where its command goes to the robot.

    Zero for a loop that is not stable.
    """
    matrix = loop.transition_matrix()
    if np.abs(np.linalg.eigvals(matrix)).max() >= 1.0:
        return DiskMargin(0.0, 0.0)
    held = len(matrix) - 3
    others = np.delete(np.arange(len(matrix)), held)
    A, B = matrix[np.ix_(others, others)], matrix[others, held]
    C, D = matrix[held, others], matrix[held, held]
    nyquist = np.pi / loop.period_s
    frequency = np.geomspace(_SLOWEST * nyquist, nyquist, _FREQUENCIES)
    z = np.exp(1j * frequency * loop.period_s)
    shifted = z[:, None, None] * np.eye(len(A)) - A
    response = np.linalg.solve(shifted, np.broadcast_to(B[:, None], (len(z), len(B), 1)))
    # the command decided on now is held in the next period
    around = ((C @ response)[:, 0] + D) / z
    peak = np.abs(1.0 / (1.0 - around) - 0.5)
    worst = int(peak.argmax())
    return DiskMargin(float(1.0 / peak[worst]), float(frequency[worst]))
