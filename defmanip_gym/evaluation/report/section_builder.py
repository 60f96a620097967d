"""From a suite's records and traces to its section of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from defmanip_gym.evaluation.analysis import SuiteAnalysis, analyse
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.evaluation.filter_timings import FilterTimes
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.report.animation import Animation, animation
from defmanip_gym.evaluation.report.columns import Row
from defmanip_gym.evaluation.report.figures import FigureGroup, ReachableSets, SuiteFigures
from defmanip_gym.evaluation.report.filter_columns import FilterRow
from defmanip_gym.evaluation.report.page import Section
from defmanip_gym.evaluation.report.selection import best_of_each_kind, pairs_to_watch
from defmanip_gym.evaluation.report.sentences import certificate_claim, headline, suite_claims
from defmanip_gym.evaluation.statistics.filter_effects import FilterPairs, filter_effects
from defmanip_gym.evaluation.suites import Suite
from defmanip_gym.evaluation.traces import TRACE_FOLDER, Trace, load_trace, trace_path
from defmanip_gym.evaluation.viable_shares import viable_share

PLOT_FOLDER = "plots"


@dataclass(frozen=True, kw_only=True)
class SectionBuilder:
    """Makes the sections of a comparison.

    Attributes:
        output: folder with traces, and for plots.
        made_by: the command that makes the comparison.
        contestants: who took part, in order.
        timings: decision times by contestant, s.
        filter_times: of the filters alone, by their names.
        reachable: sets of the certificates, computed when needed.
    """

    output: Path
    made_by: str
    contestants: Sequence[Contestant]
    timings: Mapping[str, float]
    filter_times: Mapping[str, FilterTimes]
    reachable: ReachableSets = field(default_factory=ReachableSets)

    def build(self, suite: Suite, records: Sequence[EpisodeRecord]) -> Section:
        """Return a suite's section; its plots are written.

        Args:
            suite: with the scenarios that were run.
            records: of the suite.

        Raises:
            RecordError: an episode is missing or there twice, or a trace is damaged.
        """
        by_name = {contestant.name: contestant for contestant in self.contestants}
        certified = [c.name for c in self.contestants if c.protection is not None]
        analysis = analyse(records, suite.name, order=list(by_name), certified=certified)
        traces = self._traces(suite)
        return Section(
            analysis=analysis,
            suite=suite.name,
            description=suite.description,
            size=_size(analysis),
            headline=headline(analysis.overall),
            claims=(*suite_claims(analysis), *filter(None, [certificate_claim(records)])),
            rows=tuple(
                Row(
                    summary=summary,
                    privileged=by_name[summary.contestant].privileged,
                    decision_time_s=self.timings.get(summary.contestant),
                )
                for summary in analysis.summaries
            ),
            filters=self._filters(records),
            figures=self._figures(analysis, traces, records),
            animations=self._animations(analysis, suite, traces, records),
        )

    def _filters(self, records: Sequence[EpisodeRecord]) -> tuple[FilterRow, ...]:
        protections = {
            c.protection.method: c.protection for c in self.contestants if c.protection is not None
        }
        return tuple(
            FilterRow(
                effect=effect,
                times=self.filter_times.get(effect.name),
                viable_share=viable_share(protections[effect.name]),
            )
            for effect in filter_effects(records, self._judged())
        )

    def _judged(self) -> tuple[FilterPairs, ...]:
        """Return the filters with those inside them, in the order of the contestants."""
        alone = {c.name for c in self.contestants if c.protection is None}
        inside: dict[str, dict[str, str]] = {}
        for contestant in self.contestants:
            if contestant.protection is not None and contestant.name_alone in alone:
                own = inside.setdefault(contestant.protection.method, {})
                own[contestant.name] = contestant.name_alone
        return tuple(FilterPairs(name=name, contestants=own) for name, own in inside.items())

    def _traces(self, suite: Suite) -> list[Trace]:
        """Return the traces that there are, contestants in order and scenarios within."""
        paths = (
            trace_path(
                self.output / TRACE_FOLDER, suite.name, contestant.name, member.name, scenario.name
            )
            for contestant in self.contestants
            for member in contestant.members
            for scenario in suite.scenarios
        )
        return [load_trace(path) for path in paths if path.exists()]

    def _figures(
        self, analysis: SuiteAnalysis, traces: Sequence[Trace], records: Sequence[EpisodeRecord]
    ) -> tuple[FigureGroup, ...]:
        return SuiteFigures(
            folder=self.output / PLOT_FOLDER,
            made_by=self.made_by,
            analysis=analysis,
            contestants={contestant.name: contestant for contestant in self.contestants},
            chosen=best_of_each_kind(analysis, self.contestants),
            traces=traces,
            uncovered=frozenset(
                (r.contestant, r.member, r.scenario)
                for r in records
                if r.certificate_applies is False
            ),
            reachable=self.reachable,
        ).draw()

    def _animations(
        self,
        analysis: SuiteAnalysis,
        suite: Suite,
        traces: Sequence[Trace],
        records: Sequence[EpisodeRecord],
    ) -> tuple[Animation, ...]:
        """Return the best analytic and the best learned one on the first scenario traced of both.

        One animation for those without and one for those with a certificate.
        """
        colours = {contestant.name: contestant.colour for contestant in self.contestants}
        episodes = {(r.contestant, r.member, r.scenario): r for r in records}
        made = []
        for heading, pair in pairs_to_watch(analysis, self.contestants).items():
            first: dict[str, dict[str, Trace]] = {name: {} for name in pair}
            for trace in traces:
                if trace.contestant in first:
                    first[trace.contestant].setdefault(trace.scenario, trace)
            common = [s for s in suite.scenarios if all(s.name in own for own in first.values())]
            if not common:
                continue
            scenario = common[0]
            shown = [first[name][scenario.name] for name in pair]
            made.append(
                animation(
                    f"{heading}: {' and '.join(pair)} from {scenario.name}",
                    shown,
                    colours,
                    scenario.condition.beam.length_m,
                    [_ending(episodes[t.contestant, t.member, t.scenario]) for t in shown],
                )
            )
        return tuple(made)


def _ending(record: EpisodeRecord) -> str:
    return f"{record.outcome.replace('_', ' ')} after {record.duration_s:.1f} s"


def _size(analysis: SuiteAnalysis) -> str:
    strata = analysis.bootstrap.strata
    conditions = len(set(strata))
    under = f" under {conditions} conditions" if conditions > 1 else ""
    return (
        f"{len(strata)} scenarios{under}, {len(analysis.scores)} contestants, "
        f"{sum(table.scores.size for table in analysis.tables)} episodes."
    )
