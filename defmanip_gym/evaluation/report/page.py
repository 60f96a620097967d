"""The report as one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from defmanip_gym.evaluation.analysis import SuiteAnalysis
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.evaluation.report.animation import Animation
from defmanip_gym.evaluation.report.columns import COLUMNS, Row
from defmanip_gym.evaluation.report.figures import FigureGroup, Panel
from defmanip_gym.evaluation.report.filter_columns import FILTER_COLUMNS, FilterRow
from defmanip_gym.evaluation.report.sentences import Claim
from defmanip_gym.files import write_atomically


@dataclass(frozen=True, kw_only=True)
class Section:
    """A suite's part of the page.

    Attributes:
        analysis: of the suite.
        suite: name.
        description: of the suite.
        size: how much was run, in words.
        headline: who is best, in a few words.
        claims: what may be said.
        rows: of the table.
        filters: rows of the table of filters, none without pairs to judge them by.
        figures: in order.
        animations: in order.
    """

    analysis: SuiteAnalysis
    suite: str
    description: str
    size: str
    headline: str
    claims: tuple[Claim, ...]
    rows: tuple[Row, ...]
    filters: tuple[FilterRow, ...]
    figures: tuple[FigureGroup, ...]
    animations: tuple[Animation, ...]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What the report says first.

    Attributes:
        text: what learning adds, in a sentence or two.
        picture: the best of both kinds on each suite.
    """

    text: str
    picture: Panel


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A line of the report's list of settings."""

    name: str
    value: str


def write_page(
    path: Path,
    *,
    answer: Answer | None,
    sections: Sequence[Section],
    contestants: Sequence[Contestant],
    settings: Sequence[Setting],
    command: str,
) -> None:
    """Write the report.

    Args:
        path: of the HTML file.
        answer: at the top; None without learned or without analytic contestants.
        sections: one for each suite.
        contestants: who took part.
        settings: of the comparison, and versions of the software.
        command: makes the same report again.
    """
    environment = Environment(
        loader=PackageLoader("defmanip_gym.evaluation"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}
    html = environment.get_template("report.html.j2").render(
        answer=answer,
        sections=sections,
        contestants=contestants,
        colours={contestant.name: contestant.colour for contestant in contestants},
        columns=COLUMNS,
        filter_columns=FILTER_COLUMNS,
        settings=settings,
        command=command,
    )
    write_atomically(path, html.encode("utf-8"))
