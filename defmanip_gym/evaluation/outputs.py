"""Everything a comparison leaves behind besides its records, made from records and traces."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.table import Table

from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.evaluation.filter_timings import FILTER_TIMING_FILE, read_filter_times
from defmanip_gym.evaluation.plots.overview import Best, plot_overview
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.report.exports import (
    latex_filter_table,
    latex_table,
    markdown_filter_table,
    markdown_table,
    write_csv,
)
from defmanip_gym.evaluation.report.figures import drawn
from defmanip_gym.evaluation.report.page import Answer, Section, Setting, write_page
from defmanip_gym.evaluation.report.section_builder import PLOT_FOLDER, SectionBuilder
from defmanip_gym.evaluation.report.sentences import answer
from defmanip_gym.evaluation.report.terminal import filter_terminal_table, terminal_table
from defmanip_gym.evaluation.suites import HORIZON_S, suite_named
from defmanip_gym.evaluation.timings import TIMING_FILE, read_timings
from defmanip_gym.files import write_atomically

TABLE_FILE, REPORT_FILE = "summary.csv", "report.html"
TABLE_FOLDER = "tables"


def write_outputs(
    config: ComparisonConfig,
    contestants: Sequence[Contestant],
    records: Sequence[EpisodeRecord],
) -> tuple[tuple[Section, ...], Path]:
    """Write tables, plots and report of these contestants; return sections and report's path.

    Raises:
        RecordError: an episode is missing or there twice.
    """
    present = {record.suite for record in records}
    builder = SectionBuilder(
        output=config.output,
        made_by=config.command,
        contestants=contestants,
        timings=read_timings(config.output / TIMING_FILE),
        filter_times=read_filter_times(config.output / FILTER_TIMING_FILE),
    )
    sections = tuple(
        builder.build(suite, [record for record in records if record.suite == suite.name])
        for suite in config.chosen_suites
        if suite.name in present
    )
    write_csv(config.output / TABLE_FILE, {section.suite: section.rows for section in sections})
    for section in sections:
        for name, table in _tables(section, config.command).items():
            write_atomically(config.output / TABLE_FOLDER / name, table.encode("utf-8"))
    report = config.output / REPORT_FILE
    write_page(
        report,
        answer=_answer(sections, config),
        sections=sections,
        contestants=contestants,
        settings=_settings(),
        command=config.command,
    )
    return sections, report


def _answer(sections: Sequence[Section], config: ComparisonConfig) -> Answer | None:
    """Return what learning adds, if both kinds took part."""
    best = []
    for section in sections:
        duel = section.analysis.main_duel
        if duel is not None:
            summaries = {each.contestant: each for each in section.analysis.summaries}
            analytic, learned = summaries[duel.result.analytic], summaries[duel.result.learned]
            best.append(Best(section.suite, analytic, learned))
    if not best:
        return None
    picture = drawn(
        plot_overview(best),
        config.output / PLOT_FOLDER / "overview.png",
        config.command,
        alt="score of the best analytic and the best learned contestant in each suite",
    )
    return Answer(text=answer([section.analysis for section in sections]), picture=picture)


def print_results(console: Console, sections: Sequence[Section], report: Path) -> None:
    """Print each suite's table and claims, and where the report is."""
    for section in sections:
        _print_whole(console, terminal_table(section.suite, section.rows))
        if section.filters:
            _print_whole(console, filter_terminal_table(section.suite, section.filters))
        for claim in section.claims:
            console.print(claim.text, highlight=False, markup=False)
        console.print()
    console.print(f"Report: {report.resolve()}", soft_wrap=True, highlight=False)


def _tables(section: Section, command: str) -> dict[str, str]:
    """Return a suite's tables by the names of their files."""
    suite, rows, filters = section.suite, section.rows, section.filters
    tables = {
        f"{suite}.md": markdown_table(rows, command),
        f"{suite}.tex": latex_table(suite, rows, command),
    }
    if filters:
        tables |= {
            f"{suite}-filters.md": markdown_filter_table(filters, command),
            f"{suite}-filters.tex": latex_filter_table(suite, filters, command),
        }
    return tables


def _print_whole(console: Console, table: Table) -> None:
    """Print rather long lines than cells cut off, also where the output is not a terminal."""
    unlimited = console.options.update(max_width=500)
    needed = console.measure(table, options=unlimited).maximum
    Console(file=console.file, width=max(needed, console.width)).print(table)


def _settings() -> list[Setting]:
    config = suite_named("nominal").conditions[0].environment
    sigma_rad = config.sigma_rad
    packages = ("defmanip_gym", "mujoco", "gymnasium", "numpy", "scipy")
    versions = [f"Python {platform.python_version()}", *(f"{p} {version(p)}" for p in packages)]
    return [
        Setting(
            name="Constraint",
            value=f"|φ| ≤ σ = {sigma_rad:.4f} rad ({math.degrees(sigma_rad):.0f}°); exceeding it "
            "does not end an episode, but such an episode is no success",
        ),
        Setting(
            name="Limits",
            value=f"{config.task.max_speed_m_s:g} m/s and {config.task.max_acceleration_m_s2:g} "
            f"m/s² per axis for everybody; {HORIZON_S:g} simulated seconds",
        ),
        Setting(name="Versions", value=", ".join(versions)),
    ]
