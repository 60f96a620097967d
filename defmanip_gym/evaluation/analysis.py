"""What the records of a suite say: summaries, standings, and learned against analytic."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable, tabulate
from defmanip_gym.evaluation.statistics.paired import Contrast, contrast
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap
from defmanip_gym.evaluation.statistics.scores import Scores, score
from defmanip_gym.evaluation.statistics.summary import Summary, summarize
from defmanip_gym.evaluation.statistics.verdicts import (
    LearnedAgainstAnalytic,
    Standing,
    learned_against_analytic,
    standing,
)


@dataclass(frozen=True, kw_only=True)
class Duel:
    """Learned against analytic in a class of contestants, and what the two best differ by."""

    result: LearnedAgainstAnalytic
    contrast: Contrast


@dataclass(frozen=True, kw_only=True)
class SuiteAnalysis:
    """Everything that is said about a suite.

    Attributes:
        suite: name.
        bootstrap: of its scenarios.
        scores: of each contestant, in the comparison's order.
        summaries: likewise.
        overall: standing of all contestants.
        certified: standing of those with an enforced certificate; None without any.
        free_duel: among contestants without certificate; None without both kinds.
        certified_duel: among those with one.
    """

    suite: str
    bootstrap: CrossedBootstrap
    scores: tuple[Scores, ...]
    summaries: tuple[Summary, ...]
    overall: Standing
    certified: Standing | None
    free_duel: Duel | None
    certified_duel: Duel | None

    @property
    def main_duel(self) -> Duel | None:
        """The duel inside filters, or, where there is none, without."""
        return self.certified_duel or self.free_duel

    @property
    def tables(self) -> tuple[EpisodeTable, ...]:
        """Episodes of each contestant."""
        return tuple(scores.table for scores in self.scores)

    def best(self, family: str, among: Collection[str]) -> str | None:
        """Return the highest interquartile mean of a family among some contestants, if any."""
        own = {s.contestant for s in self.scores if s.table.family == family}
        return next((name for name in self.overall.order if name in own and name in among), None)


def analyse(
    records: Iterable[EpisodeRecord],
    suite: str,
    *,
    order: Sequence[str],
    certified: Collection[str],
) -> SuiteAnalysis:
    """Return the analysis of a suite that has records.

    Args:
        records: of any suites.
        suite: name.
        order: names of the contestants; the records of others are left out.
        certified: names of those with an enforced certificate.

    Raises:
        RecordError: an episode is missing or there twice.
    """
    own = [record for record in records if record.contestant in set(order)]
    tables = sorted(tabulate(own, suite), key=lambda table: order.index(table.contestant))
    bootstrap = CrossedBootstrap(tables[0].conditions)
    scores = tuple(score(bootstrap, table) for table in tables)
    within = [entry for entry in scores if entry.contestant in certified]
    free = [entry for entry in scores if entry.contestant not in certified]
    return SuiteAnalysis(
        suite=suite,
        bootstrap=bootstrap,
        scores=scores,
        summaries=tuple(summarize(bootstrap, entry) for entry in scores),
        overall=standing(scores),
        certified=standing(within) if within else None,
        free_duel=_duel(bootstrap, free),
        certified_duel=_duel(bootstrap, within),
    )


def _duel(bootstrap: CrossedBootstrap, contestants: Sequence[Scores]) -> Duel | None:
    result = learned_against_analytic(contestants)
    if result is None:
        return None
    tables = {entry.contestant: entry.table for entry in contestants}
    return Duel(
        result=result,
        contrast=contrast(bootstrap, tables[result.learned], tables[result.analytic]),
    )
