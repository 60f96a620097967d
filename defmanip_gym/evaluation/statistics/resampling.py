"""Two bootstraps: over training runs on fixed scenarios, and over members and scenarios alike."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.statistics.aggregates import Aggregate
from defmanip_gym.validation import require_whole, settle

Array = NDArray[np.float64]
IndexArray = NDArray[np.intp]

RESAMPLES = 2_000
_SEED = 0  # the same records give the same report
_CHUNK = 1_000_000  # numbers resampled at a time: 8 MB


def stratified_draws(
    values: Array, statistic: Aggregate, *, resamples: int = RESAMPLES, seed: int = _SEED
) -> Array:
    """Return a statistic of resampled runs, (R, ...): what retraining alone would change.

    Runs are drawn anew for every task, the tasks stay (Agarwal et al. 2021, and rliable).

    Args:
        values: (runs, tasks), two runs or more.
        statistic: of arrays (..., runs, tasks).
        resamples: R.
        seed: equal seeds give equal draws.

    Raises:
        ParameterError: a single run, which has no scatter.
    """
    resamples = require_whole("resamples", resamples, 1)
    runs, tasks = values.shape
    if runs < 2:
        raise ParameterError("runs", runs, "two or more", "One run has no scatter: train another.")
    generator = np.random.default_rng(seed)
    draws = []
    for start, stop in _chunks(resamples, values.size):
        chosen = generator.integers(runs, size=(stop - start, runs, tasks))
        draws.append(statistic(values[chosen, np.arange(tasks)]))
    return np.concatenate(draws)


@dataclass(frozen=True)
class Sample:
    """One contestant's values.

    Attributes:
        name: of the contestant; its members are resampled on their own.
        values: (members, scenarios).
    """

    name: str
    values: Array


@dataclass(frozen=True)
class CrossedBootstrap:
    """Resamples of members and of scenarios, independently of each other.

    Every member meets every scenario, so neither episodes nor rows are independent. Rows and
    columns are drawn separately: scenarios within their condition, *the same for all contestants*,
    which pairs them; members for each contestant on its own. A contestant with one member keeps it.
    A. B. Owen, "The pigeonhole bootstrap", Ann. Appl. Stat. 1 (2007), shows that this errs on the
    safe side in what each single episode contributes. What members differ by is underestimated, as
    in every bootstrap of a handful of runs: where five members make all the difference, an interval
    for 95 % covers some 85 %. Verdicts therefore rest on ``scores`` instead.

    Attributes:
        strata: condition of each scenario.
        resamples: R.
        seed: equal seeds give equal draws, whoever else takes part.
    """

    strata: tuple[str, ...]
    resamples: int = RESAMPLES
    seed: int = _SEED

    def __post_init__(self) -> None:
        settle(self, "resamples", require_whole, 1)
        require_whole("scenarios", len(self.strata), 1)

    @cached_property
    def scenarios(self) -> IndexArray:
        """Drawn scenarios, (R, scenarios)."""
        generator = np.random.default_rng(self.seed)
        drawn = np.empty((self.resamples, len(self.strata)), dtype=np.intp)
        labels = np.array(self.strata)
        for condition in dict.fromkeys(self.strata):
            (own,) = np.nonzero(labels == condition)
            drawn[:, own] = own[generator.integers(len(own), size=(self.resamples, len(own)))]
        return drawn

    def draws(self, statistic: Callable[..., Array], *samples: Sample) -> Array:
        """Return a statistic of the resamples, (R, ...).

        Args:
            statistic: takes an array (..., members, scenarios) for each sample.
            samples: over the scenarios of ``strata``.

        Raises:
            ParameterError: a sample over another number of scenarios.
        """
        return self._draws(statistic, samples, [self._members(sample) for sample in samples])

    def draws_of_scenarios(self, statistic: Callable[..., Array], sample: Sample) -> Array:
        """Return a statistic of resampled scenarios and the members as they are, (R, ...)."""
        everyone = np.arange(len(sample.values))
        rows = np.broadcast_to(everyone, (self.resamples, len(everyone)))
        return self._draws(statistic, [sample], [rows])

    def _draws(
        self,
        statistic: Callable[..., Array],
        samples: Sequence[Sample],
        members: Sequence[IndexArray],
    ) -> Array:
        for sample in samples:
            if sample.values.shape[1] != len(self.strata):
                raise ParameterError(
                    f"scenarios of {sample.name}",
                    sample.values.shape[1],
                    f"the {len(self.strata)} of the suite",
                    "Compare on the same scenarios.",
                )
        largest = max(sample.values.size for sample in samples)
        results = []
        for start, stop in _chunks(self.resamples, largest):
            columns = self.scenarios[start:stop, None, :]
            resampled = (
                sample.values[rows[start:stop, :, None], columns]
                for sample, rows in zip(samples, members, strict=True)
            )
            results.append(statistic(*resampled))
        return np.concatenate(results)

    def _members(self, sample: Sample) -> IndexArray:
        """Return drawn members, (R, members), always the same for a name."""
        count = len(sample.values)
        generator = np.random.default_rng((self.seed, zlib.crc32(sample.name.encode("utf-8"))))
        return generator.integers(count, size=(self.resamples, count))


def _chunks(resamples: int, size: int) -> Sequence[tuple[int, int]]:
    step = max(1, _CHUNK // size)
    return [(start, min(start + step, resamples)) for start in range(0, resamples, step)]
