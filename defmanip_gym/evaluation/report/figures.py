"""A suite's figures, grouped as the page shows them."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from defmanip_gym.evaluation.analysis import SuiteAnalysis
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.evaluation.options import FILTER_OPTION
from defmanip_gym.evaluation.plots.condition_scores import (
    plot_score_by_condition,
    plot_success_by_condition,
)
from defmanip_gym.evaluation.plots.forest import plot_forest
from defmanip_gym.evaluation.plots.panel import as_png
from defmanip_gym.evaluation.plots.phase import Edge, kept_set, plot_phase
from defmanip_gym.evaluation.plots.score_profiles import plot_profiles
from defmanip_gym.evaluation.plots.swing import plot_swing
from defmanip_gym.evaluation.protection import Protection, StorageProtection
from defmanip_gym.evaluation.statistics.profiles import Profile, performance_profile
from defmanip_gym.evaluation.statistics.resampling import Sample
from defmanip_gym.evaluation.traces import Trace
from defmanip_gym.files import write_atomically

_THRESHOLDS = 81


@dataclass(frozen=True, kw_only=True)
class Panel:
    """An image as the page embeds it; width and height in CSS pixels."""

    alt: str
    data_uri: str
    width: int
    height: int


@dataclass(frozen=True, kw_only=True)
class FigureGroup:
    """Panels under one heading.

    Attributes:
        title: heading.
        caption: how to read them.
        panels: shown at once.
        more: shown on demand.
    """

    title: str
    caption: str
    panels: tuple[Panel, ...]
    more: tuple[Panel, ...] = ()


def drawn(figure: Figure, path: Path, made_by: str, *, alt: str) -> Panel:
    """Write a figure's file and return it as the page embeds it."""
    png, width, height = as_png(figure, made_by)
    write_atomically(path, png)
    encoded = base64.b64encode(png).decode("ascii")
    return Panel(alt=alt, data_uri=f"data:image/png;base64,{encoded}", width=width, height=height)


class ReachableSets:
    """Edges of what filters keep the swing in, computed once each."""

    def __init__(self) -> None:
        self._edges: dict[Protection, Edge | None] = {}

    def of(self, protection: Protection | None) -> Edge | None:
        """Return the edge, None without filter or where it is not known."""
        if protection is None:
            return None
        if protection not in self._edges:
            self._edges[protection] = kept_set(protection)
        return self._edges[protection]


@dataclass(frozen=True, kw_only=True)
class SuiteFigures:
    """Draws the figures of a suite and keeps each as a file.

    Attributes:
        folder: of the files.
        made_by: the command, written into each file.
        analysis: of the suite.
        contestants: who took part.
        chosen: names of those shown at once.
        traces: of the suite.
        uncovered: (contestant, member, scenario) of episodes that the filter does not cover.
        reachable: shared by the suites.
    """

    folder: Path
    made_by: str
    analysis: SuiteAnalysis
    contestants: Mapping[str, Contestant]
    chosen: Sequence[str]
    traces: Sequence[Trace]
    uncovered: frozenset[tuple[str, str, str]]
    reachable: ReachableSets

    @property
    def colours(self) -> dict[str, str]:
        """Of all contestants."""
        return {name: contestant.colour for name, contestant in self.contestants.items()}

    def draw(self) -> tuple[FigureGroup, ...]:
        """Return all groups that there is something to show for."""
        return tuple(group for group in self._groups() if group.panels)

    def _groups(self) -> Iterator[FigureGroup]:
        yield self._scores()
        if len(set(self.analysis.bootstrap.strata)) > 1:
            yield self._conditions()
        yield self._swings()
        yield self._phases()

    def _scores(self) -> FigureGroup:
        return FigureGroup(
            title="Scores and profiles",
            caption="Left, interquartile means of the score, all contestants. Right, the share of "
            "episodes that score above τ, for the best analytic and the best learned contestant, "
            "without and with certificate.",
            panels=(
                self._panel("forest", plot_forest(self.analysis.summaries, self.colours)),
                self._panel("profiles", plot_profiles(self._profiles(), self.colours)),
            ),
        )

    def _profiles(self) -> dict[str, Profile]:
        tables = {table.contestant: table for table in self.analysis.tables}
        highest = max(float(table.scores.max()) for table in tables.values())
        thresholds = np.linspace(0.0, 1.05 * max(highest, 0.05), _THRESHOLDS)
        return {
            name: performance_profile(
                self.analysis.bootstrap, Sample(name, tables[name].scores), thresholds
            )
            for name in self.chosen
        }

    def _conditions(self) -> FigureGroup:
        tables = [table for table in self.analysis.tables if table.contestant in self.chosen]
        return FigureGroup(
            title="By condition",
            caption="What each condition does to success and score; lines are 95 % intervals, "
            "missing where one start was run once.",
            panels=(
                self._panel("success", plot_success_by_condition(tables, self.colours)),
                self._panel("conditions", plot_score_by_condition(tables, self.colours)),
            ),
        )

    def _swings(self) -> FigureGroup:
        panels = {
            name: self._panel(f"swing-{_stem(name)}", plot_swing(own, self.colours[name]))
            for name, own in self._by_contestant().items()
        }
        return self._ordered(
            "Swing against ±σ",
            "Swing over time in the suite's traced episodes, each panel on its own time axis; the "
            "strong line is the first scenario, a dot the end of an episode. Swings beyond 1.5 σ "
            "are cut off.",
            panels,
        )

    def _phases(self) -> FigureGroup:
        panels = {
            name: self._panel(f"phase-{_stem(name)}", self._phase(name, own))
            for name, own in self._by_contestant().items()
        }
        return self._ordered(
            "Phase plane",
            "Swing and swing rate of the same episodes. Filled: what the filter keeps the "
            "nominal beam in; grey outline: the same of "
            f"{FILTER_OPTION} where there is none. Dotted: episodes that the filter does not "
            "cover.",
            panels,
        )

    def _phase(self, name: str, traces: Sequence[Trace]) -> Figure:
        protection = self.contestants[name].protection
        shown = protection or StorageProtection(FILTER_OPTION)
        return plot_phase(
            traces,
            self.colours[name],
            edge=self.reachable.of(shown),
            is_enforced=protection is not None,
            uncovered={t.scenario for t in traces if self._key(t) in self.uncovered},
        )

    def _ordered(self, title: str, caption: str, panels: dict[str, Panel]) -> FigureGroup:
        return FigureGroup(
            title=title,
            caption=caption,
            panels=tuple(panels[name] for name in self.chosen if name in panels),
            more=tuple(panel for name, panel in panels.items() if name not in self.chosen),
        )

    def _by_contestant(self) -> dict[str, list[Trace]]:
        """Return the traces of each contestant's first traced member."""
        groups: dict[str, list[Trace]] = {}
        for trace in self.traces:
            own = groups.setdefault(trace.contestant, [])
            if not own or own[0].member == trace.member:
                own.append(trace)
        return groups

    def _panel(self, name: str, figure: Figure) -> Panel:
        path = self.folder / self.analysis.suite / f"{name}.png"
        return drawn(figure, path, self.made_by, alt=f"{name} in suite {self.analysis.suite}")

    def _key(self, trace: Trace) -> tuple[str, str, str]:
        return trace.contestant, trace.member, trace.scenario


def _stem(contestant: str) -> str:
    return contestant.replace("/", "+")
