"""Fair timing: candidates take turns over several rounds, and ratios are taken round by round."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Action = Callable[[], object]

# Every candidate is called so often before its first turn, for code compiled on first use.
_WARM_UP_CALLS = 5


def _nothing() -> None:
    pass


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Something to time.

    Attributes:
        name: for tables.
        step: one call, timed.
        num_envs: environment steps in a call.
        prepare: called before every ``step``, not timed.
        close: frees what the candidate holds.
    """

    name: str
    step: Action
    num_envs: int = 1
    prepare: Action = _nothing
    close: Action = _nothing


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One line of a table: the median over the rounds and its spread.

    Attributes:
        name: what was measured.
        value: median.
        low: smallest of the rounds.
        high: largest of the rounds.
        unit: unit, or what the ratio refers to.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str

    @classmethod
    def of(cls, name: str, rounds: Iterable[float], unit: str) -> Figure:
        """Return the figure of one value per round."""
        values = np.array(list(rounds))
        return cls(
            name=name,
            value=float(np.median(values)),
            low=float(values.min()),
            high=float(values.max()),
            unit=unit,
        )


@dataclass(frozen=True)
class Times:
    """Seconds per environment step of each candidate in each round."""

    seconds: Mapping[str, Array]

    def rate(self, name: str) -> Figure:
        """Return environment steps per second."""
        return Figure.of(name, 1 / self.seconds[name], "env steps/s")

    def speed(self, name: str, reference: str) -> Figure:
        """Return how many times as fast as the reference a candidate is."""
        ratio = self.seconds[reference] / self.seconds[name]
        return Figure.of(f"speed of {name}", ratio, f"× {reference}")

    def cost(self, name: str, reference: str) -> Figure:
        """Return a candidate's time over the reference's."""
        ratio = self.seconds[name] / self.seconds[reference]
        return Figure.of(f"time of {name}", ratio, f"× {reference}")

    def beyond(self, name: str, reference: str) -> Figure:
        """Return the microseconds that a step takes beyond the reference's."""
        extra = 1e6 * (self.seconds[name] - self.seconds[reference])
        return Figure.of(f"{name} beyond physics", extra, "µs per step")


def undisturbed(seconds: Array) -> float:
    """Return what a call takes while nothing else runs: the fastest tenth of a turn's calls."""
    return float(np.quantile(seconds, 0.1))


def take_turns(
    candidates: Iterable[Candidate],
    *,
    rounds: int,
    turn_s: float,
    summary: Callable[[Array], float] = np.mean,
) -> Times:
    """Time all candidates in turn, several rounds, and close them.

    The first round warms up and does not count.

    Args:
        candidates: with different names.
        rounds: how many count.
        turn_s: least timed seconds of a turn.
        summary: makes one value of the seconds of a turn's calls.
    """
    candidates = list(candidates)
    seconds: dict[str, list[float]] = {candidate.name: [] for candidate in candidates}
    try:
        for candidate in candidates:
            _turn(candidate, turn_s, summary, least_calls=_WARM_UP_CALLS)
        for _ in range(rounds):
            for candidate in candidates:
                seconds[candidate.name].append(_turn(candidate, turn_s, summary))
    finally:
        for candidate in candidates:
            candidate.close()
    return Times({name: np.array(values) for name, values in seconds.items()})


def _turn(
    candidate: Candidate,
    turn_s: float,
    summary: Callable[[Array], float],
    *,
    least_calls: int = 1,
) -> float:
    """Return the seconds per environment step in one turn."""
    step, prepare, clock = candidate.step, candidate.prepare, time.perf_counter
    elapsed, calls = 0.0, []
    while elapsed < turn_s or len(calls) < least_calls:
        prepare()
        begin = clock()
        step()
        calls.append(clock() - begin)
        elapsed += calls[-1]
    return summary(np.array(calls)) / candidate.num_envs
