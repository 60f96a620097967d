"""Everything a comparison leaves behind besides its records, made from records and traces."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from rich.console import Console

from defmanip_gym.display import save_figure
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestants import Contestant
from defmanip_gym.evaluation.plots import PLOTS
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.report import Figure, Setting, embedded, write_report
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED
from defmanip_gym.evaluation.statistics import Summary, summarize
from defmanip_gym.evaluation.table import terminal_table, write_csv
from defmanip_gym.evaluation.traces import Trace, load_trace, trace_path
from defmanip_gym.params import PAPER_DISTURBANCE

TABLE_FILE, REPORT_FILE = "summary.csv", "report.html"
TRACE_FOLDER, PLOT_FOLDER = "traces", "plots"
_UNLIMITED_WIDTH = 500


def write_outputs(
    config: ComparisonConfig,
    contestants: Sequence[Contestant],
    records: Sequence[EpisodeRecord],
) -> tuple[tuple[Summary, ...], Path]:
    """Write table, plots and report of these contestants; return summaries and report's path."""
    order = [contestant.name for contestant in contestants]
    own = [record for record in records if record.contestant in order]
    summaries = summarize(sorted(own, key=lambda record: order.index(record.contestant)))
    write_csv(config.output / TABLE_FILE, summaries)
    report = config.output / REPORT_FILE
    write_report(
        report,
        summaries=summaries,
        contestants=contestants,
        figures=_figures(config.output, contestants, own),
        settings=_settings(config),
        versions=_versions(),
        command=config.command,
    )
    return summaries, report


def print_results(console: Console, summaries: Sequence[Summary], report: Path) -> None:
    """Print the table and where the report is."""
    table = terminal_table(summaries)
    # rather long lines than cells cut off, also where the output is not a terminal
    unlimited = console.options.update(max_width=_UNLIMITED_WIDTH)
    needed = console.measure(table, options=unlimited).maximum
    wide = Console(file=console.file, width=max(needed, console.width))
    wide.print(table)
    console.print(f"Report: {report.resolve()}", soft_wrap=True, highlight=False)


def _figures(
    folder: Path, contestants: Sequence[Contestant], records: Sequence[EpisodeRecord]
) -> list[Figure]:
    """Draw what there are traces of."""
    colours = {contestant.name: contestant.colour for contestant in contestants}
    traces = _traces(folder / TRACE_FOLDER, list(colours), records)
    if not traces:
        return []
    figures = []
    for plot in PLOTS:
        path = folder / PLOT_FOLDER / f"{plot.name}.png"
        save_figure(path, plot.draw(traces, colours))
        figures.append(embedded(plot, path.read_bytes()))
    return figures


def _traces(
    folder: Path, contestants: Sequence[str], records: Sequence[EpisodeRecord]
) -> list[Trace]:
    """Return the traces of recorded episodes, scenarios in order and contestants within."""
    scenarios = sorted({record.scenario for record in records})  # "paper" before "sampled-…"
    paths = [
        trace_path(folder, contestant, scenario)
        for scenario in scenarios
        for contestant in contestants
    ]
    return [load_trace(path) for path in paths if path.exists()]


def _settings(config: ComparisonConfig) -> list[Setting]:
    disturbance = PAPER_DISTURBANCE
    last_seed = FIRST_EVALUATION_SEED + config.episodes - 1
    return [
        Setting(
            name="Scenarios",
            value=f"{config.episodes} for each contestant: the paper's start and "
            f"{config.episodes - 1} sampled around it (seeds {FIRST_EVALUATION_SEED} to "
            f"{last_seed}, none used in training)",
        ),
        Setting(name="Horizon", value=f"{config.horizon_s:g} simulated seconds"),
        Setting(
            name="Constraint",
            value=f"|φ| ≤ σ = {config.sigma_rad:.4f} rad ({math.degrees(config.sigma_rad):.0f}°)",
        ),
        Setting(name="Damping of the beam", value=f"{config.damping:g} N·m·s/rad"),
        Setting(
            name="Disturbance",
            value=f"{disturbance.force_amplitude_n:g} sin t + {disturbance.force_bias_n:g} N at "
            "the grasp, along each axis",
        ),
    ]


def _versions() -> list[Setting]:
    packages = ("defmanip_gym", "mujoco", "gymnasium", "numpy", "scipy")
    return [
        Setting(name="Python", value=platform.python_version()),
        *(Setting(name=name, value=version(name)) for name in packages),
    ]
