"""Records of a contestant in a suite, arranged as (members, scenarios)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.entry import Family
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics.aggregates import Array

Reading = Callable[[EpisodeRecord], float | None]


@dataclass(frozen=True, kw_only=True)
class EpisodeTable:
    """One contestant in one suite: every member in every scenario.

    Attributes:
        contestant: name.
        family: what kind of controller it is.
        members: rows.
        scenarios: columns, the same for all contestants of the suite.
        conditions: of each scenario; the strata of the bootstrap.
        rows: the records.
    """

    contestant: str
    family: Family
    members: tuple[str, ...]
    scenarios: tuple[str, ...]
    conditions: tuple[str, ...]
    rows: tuple[tuple[EpisodeRecord, ...], ...]

    @property
    def records(self) -> tuple[EpisodeRecord, ...]:
        """All records, member after member."""
        return tuple(record for row in self.rows for record in row)

    def values(self, reading: Reading) -> Array:
        """Return a number of each episode, (members, scenarios); NaN where it has none."""
        numbers = ([reading(record) for record in row] for row in self.rows)
        return np.array(
            [[np.nan if x is None else float(x) for x in row] for row in numbers], dtype=np.float64
        )

    @property
    def scores(self) -> Array:
        """Mean speed towards the goal as a share of the speed limit; 0 without success."""
        return self.values(lambda record: record.score)

    @property
    def successes(self) -> Array:
        """1 where the goal was reached without ever exceeding σ, else 0."""
        return self.values(lambda record: record.success)

    @property
    def times_to_goal(self) -> Array:
        """Seconds to the goal; NaN without success."""
        return self.values(lambda record: record.time_to_goal_s if record.success else None)


def tabulate(records: Iterable[EpisodeRecord], suite: str) -> tuple[EpisodeTable, ...]:
    """Return a table for each contestant of a suite, in the order in which they first appear.

    Raises:
        RecordError: an episode is missing or there twice, so that nothing could be paired.
    """
    own = [record for record in records if record.suite == suite]
    conditions = {record.scenario: record.condition for record in own}
    groups: dict[str, list[EpisodeRecord]] = {}
    for record in own:
        groups.setdefault(record.contestant, []).append(record)
    return tuple(_table(name, group, conditions) for name, group in groups.items())


def _table(
    contestant: str, records: list[EpisodeRecord], conditions: dict[str, str]
) -> EpisodeTable:
    episodes = {(record.member, record.scenario): record for record in records}
    members = tuple(dict.fromkeys(record.member for record in records))
    wanted = {(member, scenario) for member in members for scenario in conditions}
    if len(episodes) != len(records) or set(episodes) != wanted:
        suite = records[0].suite
        raise RecordError(
            "records",
            f"{len(records)} episodes of {contestant} in suite {suite}",
            f"one of each of its {len(members)} members in each of {len(conditions)} scenarios",
            "Let the evaluation finish: run the same command again.",
        )
    return EpisodeTable(
        contestant=contestant,
        family=records[0].family,
        members=members,
        scenarios=tuple(conditions),
        conditions=tuple(conditions.values()),
        rows=tuple(
            tuple(episodes[member, scenario] for scenario in conditions) for member in members
        ),
    )
