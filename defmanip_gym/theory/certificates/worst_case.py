"""The smallest bound over intervals of parameters, by branch and bound: no sampling gaps.

A box of parameters gets a bound that holds for every object in it (``small_gain``); its middle
alone gets a larger one. The box with the smallest bound is split until the two nearly agree.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from defmanip_gym.theory.certificates.conditions import ParameterIntervals

_ACCURACY = 0.05


@dataclass(frozen=True, kw_only=True)
class BoxBound:
    """What is known about the objects in one box.

    Attributes:
        guaranteed: bound that holds for all of them; 0 if none is known.
        at_middle: bound for the object in the middle.
        damping_cost: how much of the guarantee not knowing the damping costs, any scale.
        stiffness_cost: the same for the stiffness.
    """

    guaranteed: float
    at_middle: float
    damping_cost: float
    stiffness_cost: float


@dataclass(frozen=True, kw_only=True)
class WorstCase:
    """Smallest bound over the intervals.

    Attributes:
        bound: holds for every object in the intervals; within 5 % of the bound at the middle of
            some box, or farther below where the boxes did not suffice.
        damping: factor on the damping where the bound is smallest.
        stiffness: factor on the stiffness there.
    """

    bound: float
    damping: float
    stiffness: float


def worst_case(
    intervals: ParameterIntervals,
    evaluate: Callable[[ParameterIntervals], BoxBound],
    *,
    most_boxes: int = 400,
) -> WorstCase:
    """Return the smallest bound over the intervals; bound 0 where nothing could be guaranteed.

    Args:
        intervals: factors on damping and stiffness.
        evaluate: bounds for one box.
        most_boxes: how many of them at most.
    """
    order = itertools.count()
    first = evaluate(intervals)
    boxes = [(first.guaranteed, next(order), intervals, first)]
    smallest_at_middle = first.at_middle
    for _ in range(most_boxes // 2):
        guaranteed, _, box, known = boxes[0]
        if guaranteed >= (1 - _ACCURACY) * smallest_at_middle:
            break
        heapq.heappop(boxes)
        for half in _halves(box, known):
            result = evaluate(half)
            smallest_at_middle = min(smallest_at_middle, result.at_middle)
            heapq.heappush(boxes, (result.guaranteed, next(order), half, result))
        if smallest_at_middle <= 0:
            break
    guaranteed, _, box, _ = boxes[0]
    return WorstCase(
        bound=guaranteed,
        damping=float(np.mean(box.damping)),
        stiffness=float(np.mean(box.stiffness)),
    )


def _halves(box: ParameterIntervals, known: BoxBound) -> tuple[ParameterIntervals, ...]:
    """Halve the interval whose width costs more."""
    if known.damping_cost >= known.stiffness_cost:
        low, middle, high = _split(box.damping)
        return (
            ParameterIntervals(damping=(low, middle), stiffness=box.stiffness),
            ParameterIntervals(damping=(middle, high), stiffness=box.stiffness),
        )
    low, middle, high = _split(box.stiffness)
    return (
        ParameterIntervals(damping=box.damping, stiffness=(low, middle)),
        ParameterIntervals(damping=box.damping, stiffness=(middle, high)),
    )


def _split(interval: tuple[float, float]) -> tuple[float, float, float]:
    """Return the interval and where to cut it: nearer its lower end, where bounds change faster."""
    low, high = interval
    middle = (low * high) ** 0.5 if low > 0.1 * high else (0.7 * low + 0.3 * high)
    return low, middle, high
