"""What each safety filter changes, on pairs of episodes: the same controller alone and inside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics.episode_table import Reading
from defmanip_gym.evaluation.statistics.intervals import Rate, wilson_interval


@dataclass(frozen=True, kw_only=True)
class FilterPairs:
    """The contestants by whom a filter is judged.

    Attributes:
        name: of the filter.
        contestants: names of those inside it, each with its name alone.
    """

    name: str
    contestants: Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class FilterEffect:
    """A filter in one suite, over pairs of episodes that differ by the filter alone.

    Rates have Wilson's interval with as many trials as there are scenarios: episodes of several
    controllers from one start are not independent.

    Attributes:
        name: of the filter.
        controllers: names alone of those that ran both.
        violation_alone: share of episodes that exceeded σ, without the filter.
        violation_inside: with it.
        success_alone: share that reached the goal without ever exceeding σ, without the filter.
        success_inside: with it.
        changed: share of the steps whose command it changed.
        mean_correction_m_s2: mean change of the commands that it changed; None if it changed none.
        largest_correction_m_s2: of all.
        reversals_per_s: sign changes of the forward correction a second, over all episodes.
    """

    name: str
    controllers: tuple[str, ...]
    violation_alone: Rate
    violation_inside: Rate
    success_alone: Rate
    success_inside: Rate
    changed: float
    mean_correction_m_s2: float | None
    largest_correction_m_s2: float
    reversals_per_s: float


def filter_effects(
    records: Iterable[EpisodeRecord], filters: Sequence[FilterPairs]
) -> tuple[FilterEffect, ...]:
    """Return what filters did in a suite, in the given order; those without pairs are left out.

    Args:
        records: of one suite.
        filters: with the contestants by whom they are judged.
    """
    by_episode = {(r.contestant, r.member, r.scenario): r for r in records}
    effects = []
    for judged in filters:
        pairs = [
            (by_episode[alone, member, scenario], inside)
            for (name, member, scenario), inside in by_episode.items()
            if (alone := judged.contestants.get(name)) is not None
            and (alone, member, scenario) in by_episode
        ]
        if pairs:
            effects.append(_effect(judged.name, pairs))
    return tuple(effects)


def _effect(name: str, pairs: Sequence[tuple[EpisodeRecord, EpisodeRecord]]) -> FilterEffect:
    alone, inside = ([pair[side] for pair in pairs] for side in (0, 1))
    changed = _mean_over_time(inside, lambda record: record.interventions)
    correction = _mean_over_time(inside, lambda record: record.mean_intervention_m_s2)
    return FilterEffect(
        name=name,
        controllers=tuple(dict.fromkeys(record.contestant for record in alone)),
        violation_alone=_rate(alone, lambda record: record.violated),
        violation_inside=_rate(inside, lambda record: record.violated),
        success_alone=_rate(alone, lambda record: record.success),
        success_inside=_rate(inside, lambda record: record.success),
        changed=changed,
        mean_correction_m_s2=correction / changed if changed > 0 else None,
        largest_correction_m_s2=max(record.largest_correction_m_s2 or 0.0 for record in inside),
        reversals_per_s=_mean_over_time(inside, lambda record: record.correction_reversals_per_s),
    )


def _rate(records: Sequence[EpisodeRecord], reading: Reading) -> Rate:
    count = sum(bool(reading(record)) for record in records)
    scenarios = len({record.scenario for record in records})
    low, _ = wilson_interval(count * scenarios // len(records), scenarios)
    _, high = wilson_interval(-(-count * scenarios // len(records)), scenarios)
    return Rate(count=count, trials=len(records), interval=(low, high))


def _mean_over_time(records: Sequence[EpisodeRecord], reading: Reading) -> float:
    """Weight episodes by their length, so that every step counts the same."""
    values = [reading(record) or 0.0 for record in records]
    return float(np.average(values, weights=[record.duration_s for record in records]))
