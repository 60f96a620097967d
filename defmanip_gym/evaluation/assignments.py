"""What a comparison consists of, job by job, and what of it is already done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.jobs import Job, JobResult, job_fingerprint
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.store import RecordFolder
from defmanip_gym.evaluation.suites import Suite, suite_named

_TRACED_SCENARIOS = 2  # of a suite with a single condition; of others, one of each


@dataclass(kw_only=True)
class Assignment:
    """A member of a contestant on a suite.

    Attributes:
        job: the episodes that are missing, possibly none.
        fingerprint: of what all its episodes depend on.
        order: names of all the suite's scenarios.
        wanted: names of those that the comparison takes.
        done: records by scenario, also of scenarios that are not wanted this time.
    """

    job: Job
    fingerprint: str
    order: tuple[str, ...]
    wanted: frozenset[str]
    done: dict[str, EpisodeRecord]

    @property
    def records(self) -> tuple[EpisodeRecord, ...]:
        """The wanted records, in the suite's order."""
        return tuple(
            self.done[name] for name in self.order if name in self.wanted and name in self.done
        )

    def keep(self, result: JobResult, folder: RecordFolder, traces: Path) -> None:
        """Write what the job has found; the records last, for they say that all is there."""
        for episode in result.episodes:
            self.done[episode.record.scenario] = episode.record
            if episode.trace is not None:
                episode.trace.save(traces)
        records = [self.done[name] for name in self.order if name in self.done]
        folder.write(self.job.entry, self.fingerprint, records)


def assignments(
    config: ComparisonConfig, contestants: Sequence[Contestant], folder: RecordFolder
) -> tuple[Assignment, ...]:
    """Return all assignments of a comparison, suite by suite, with what is already on disk.

    Raises:
        RecordError: a file of records is damaged or was made with other settings.
    """
    threads = 0 if config.jobs == 1 else 1
    return tuple(
        _assignment(suite, contestant, member, folder, threads)
        for suite in config.chosen_suites
        for contestant in contestants
        for member in contestant.members
    )


def _assignment(
    suite: Suite, contestant: Contestant, member: Member, folder: RecordFolder, threads: int
) -> Assignment:
    whole = suite_named(suite.name)
    identity = job_fingerprint(
        whole, member.controller, contestant.protection, contestant.inner_loop
    )
    entry = Entry(
        suite=suite.name,
        contestant=contestant.name,
        family=contestant.family,
        member=member.name,
    )
    done = {record.scenario: record for record in folder.read(entry, identity)}
    missing = tuple(scenario for scenario in suite.scenarios if scenario.name not in done)
    is_first = member is contestant.members[0]
    return Assignment(
        job=Job(
            entry=entry,
            controller=member.controller,
            protection=contestant.protection,
            inner_loop=contestant.inner_loop,
            suite=replace(suite, scenarios=missing),
            traced=_traced(whole) if is_first else (),
            num_threads=threads,
        ),
        fingerprint=identity,
        order=tuple(scenario.name for scenario in whole.scenarios),
        wanted=frozenset(scenario.name for scenario in suite.scenarios),
        done=done,
    )


def _traced(suite: Suite) -> tuple[str, ...]:
    """Return the names of the scenarios whose time courses are kept."""
    conditions = suite.conditions
    count = 1 if len(conditions) > 1 else _TRACED_SCENARIOS
    return tuple(s.name for condition in conditions for s in suite.of(condition)[:count])
