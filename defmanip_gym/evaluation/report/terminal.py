"""A suite's table for the terminal: what a decision needs, a line for each contestant."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.table import Table

from defmanip_gym.evaluation.report.columns import (
    NONE,
    Cell,
    Row,
    estimate_cell,
    rate_cell,
    share_cell,
)
from defmanip_gym.evaluation.report.filter_columns import FILTER_COLUMNS, FilterRow
from defmanip_gym.evaluation.statistics.intervals import Rate


def terminal_table(suite: str, rows: Sequence[Row]) -> Table:
    """Return a table that fits into 120 columns."""
    table = Table(
        box=box.SIMPLE_HEAD,
        title=f"Suite {suite}",
        title_justify="left",
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("Contestant", no_wrap=True, style="bold")
    rates = ("Success %", "Violation %", "Swing/σ", "Time s", "Interv. %")
    for heading in ("Score IQM", "T*/T", *rates, "ms"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        summary, decision = row.summary, row.decision_time_s
        largest, tail = summary.largest_swing_share, summary.swing_share_cvar.value
        time_s = summary.time_to_goal_s
        table.add_row(
            summary.contestant,
            _on_one_line(estimate_cell(summary.score["iqm"], 2)),
            estimate_cell(summary.optimum_share, 2).value,
            _on_one_line(rate_cell(summary.success)),
            _on_one_line(rate_cell(summary.violation)),
            f"{largest:.2f} ({tail:.2f})",
            NONE if time_s is None else f"{time_s.value:.1f}",
            share_cell(summary.interventions).value,
            NONE if decision is None else f"{1e3 * decision:.2g}",
        )
    return table


def filter_terminal_table(suite: str, rows: Sequence[FilterRow]) -> Table:
    """Return the table of filters; arrows lead from alone to inside."""
    table = Table(box=box.SIMPLE_HEAD, title=f"Filters in suite {suite}", title_justify="left")
    table.add_column("Filter", no_wrap=True, style="bold")
    names = ("Violation %", "Success %", "Changed %", "m/s² (max)", "Flips 1/s", "Viable %")
    for heading in ("Pairs", *names, "µs (p99)"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        effect, cells = row.effect, [column.cell(row).value for column in FILTER_COLUMNS]
        *_, changed, mean, largest, flips, viable, median, p99 = cells
        table.add_row(
            effect.name,
            str(effect.violation_alone.trials),
            _change(effect.violation_alone, effect.violation_inside),
            _change(effect.success_alone, effect.success_inside),
            *(changed, f"{mean} ({largest})", flips, viable),
            NONE if row.times is None else f"{median} ({p99})",
        )
    return table


def _change(alone: Rate, inside: Rate) -> str:
    return f"{rate_cell(alone).value} → {_on_one_line(rate_cell(inside))}"


def _on_one_line(cell: Cell) -> str:
    return f"{cell.value} [dim]{cell.note}[/]" if cell.note else cell.value
