"""The comparison as one HTML file that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from defmanip_gym.evaluation.contestants import Contestant
from defmanip_gym.evaluation.plots import Plot
from defmanip_gym.evaluation.statistics import Summary
from defmanip_gym.evaluation.table import COLUMNS
from defmanip_gym.files import write_atomically


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A plot as the report embeds it."""

    title: str
    caption: str
    data_uri: str


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A line of the report's list of settings."""

    name: str
    value: str


def embedded(plot: Plot, png: bytes) -> Figure:
    """Return a plot with its image as a data URI."""
    encoded = base64.b64encode(png).decode("ascii")
    return Figure(
        title=plot.title, caption=plot.caption, data_uri=f"data:image/png;base64,{encoded}"
    )


def write_report(
    path: Path,
    *,
    summaries: Sequence[Summary],
    contestants: Sequence[Contestant],
    figures: Sequence[Figure],
    settings: Sequence[Setting],
    versions: Sequence[Setting],
    command: str,
) -> None:
    """Write the report.

    Args:
        path: of the HTML file.
        summaries: the table's rows.
        contestants: who takes part; must cover the summaries.
        figures: plots in order.
        settings: of the comparison, for readers.
        versions: of the software.
        command: makes the same report again.
    """
    environment = Environment(
        loader=PackageLoader("defmanip_gym.evaluation"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    by_name = {contestant.name: contestant for contestant in contestants}
    rows = [
        {
            "contestant": by_name[summary.contestant],
            "cells": [
                {"title": c.title, "value": c.value(summary), "interval": c.interval(summary)}
                for c in COLUMNS
            ],
        }
        for summary in summaries
    ]
    html = environment.get_template("report.html.j2").render(
        columns=COLUMNS,
        rows=rows,
        figures=figures,
        settings=settings,
        versions=versions,
        command=command,
    )
    write_atomically(path, html.encode("utf-8"))
