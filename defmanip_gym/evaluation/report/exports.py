"""The tables as files: CSV with full precision, Markdown, and LaTeX for papers."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from defmanip_gym.evaluation.report.columns import COLUMNS, NONE, Cell, Column, Row, RowT
from defmanip_gym.evaluation.report.filter_columns import FILTER_COLUMNS, FilterRow
from defmanip_gym.evaluation.statistics.intervals import Interval
from defmanip_gym.files import write_atomically

_LATEX = {
    "\\": r"\textbackslash{}",
    "%": r"\%",
    "_": r"\_",
    "&": r"\&",
    "#": r"\#",
    "$": r"\$",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "σ": r"$\sigma$",
    "ν": r"$\nu$",
    "∫": r"$\int$",
    "−": "$-$",
    "·": r"$\cdot$",
    "µ": r"$\mu$",
    "²": "$^2$",
    "|": "$|$",
    "<": "$<$",
    ">": "$>$",
    "–": "--",
}


def write_csv(path: Path, suites: Mapping[str, Sequence[Row]]) -> None:
    """Write all suites' summaries with full precision; units stand in the names."""
    rows = [_csv_row(suite, row) for suite, table in suites.items() for row in table]
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, fieldnames=list(rows[0]) if rows else ["suite", "contestant"])
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, buffer.getvalue().encode("utf-8"))


def markdown_table(rows: Sequence[Row], made_by: str) -> str:
    """Return a suite's table in Markdown, with intervals and the command that makes it."""
    head = ["Contestant", *(column.title for column in COLUMNS), "Knows"]
    lines = [_markdown_line(head), _markdown_line(["---", *["---:"] * len(COLUMNS), "---"])]
    for row in rows:
        cells = _markdown_cells(row, COLUMNS)
        lines.append(_markdown_line([row.summary.contestant, *cells, row.privileged]))
    return _markdown_page(lines, made_by)


def markdown_filter_table(rows: Sequence[FilterRow], made_by: str) -> str:
    """Return a suite's table of filters in Markdown, with the command that makes it."""
    head = ["Filter", *(column.title for column in FILTER_COLUMNS)]
    lines = [_markdown_line(head), _markdown_line(["---", *["---:"] * len(FILTER_COLUMNS)])]
    for row in rows:
        lines.append(_markdown_line([row.effect.name, *_markdown_cells(row, FILTER_COLUMNS)]))
    return _markdown_page(lines, made_by)


def latex_table(suite: str, rows: Sequence[Row], made_by: str) -> str:
    """Return a suite's table in LaTeX; it needs the packages booktabs and graphicx."""
    head = ["Contestant", *map(_latex_head, COLUMNS), "Privileged information"]
    lines = []
    for row in rows:
        cells = [_latex_cell(column.cell(row)) for column in COLUMNS]
        lines.append([_latex(row.summary.contestant), *cells, _latex(row.privileged)])
    layout = f"l{'r' * len(COLUMNS)}p{{5cm}}"
    return _latex_page(f"Suite {_latex(suite)}", layout, head, lines, made_by)


def latex_filter_table(suite: str, rows: Sequence[FilterRow], made_by: str) -> str:
    """Return a suite's table of filters in LaTeX; it needs the same packages."""
    head = ["Filter", *map(_latex_head, FILTER_COLUMNS)]
    lines = [
        [_latex(row.effect.name), *(_latex_cell(column.cell(row)) for column in FILTER_COLUMNS)]
        for row in rows
    ]
    layout = f"l{'r' * len(FILTER_COLUMNS)}"
    return _latex_page(f"Filters in suite {_latex(suite)}", layout, head, lines, made_by)


def _latex_page(
    title: str, layout: str, head: Sequence[str], rows: Sequence[Sequence[str]], made_by: str
) -> str:
    lines = [
        f"% Made by: {made_by}",
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{title}, with 95\,\% intervals. "
        rf"Made by \texttt{{{_latex(made_by)}}}.}}",
        r"\resizebox{\linewidth}{!}{%",
        rf"\begin{{tabular}}{{{layout}}}",
        r"\toprule",
        " & ".join(head) + r" \\",
        r"\midrule",
        *(" & ".join(row) + r" \\" for row in rows),
    ]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}}", r"\end{table}", ""])


def _markdown_page(lines: Sequence[str], made_by: str) -> str:
    return "\n".join([*lines, "", f"Made by `{made_by}`; small print: 95 % intervals.", ""])


def _markdown_cells(row: RowT, columns: Sequence[Column[RowT]]) -> list[str]:
    return [_with_note(column.cell(row), "<br>") for column in columns]


def _markdown_line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def _with_note(cell: Cell, separator: str) -> str:
    return f"{cell.value}{separator}{cell.note}" if cell.note else cell.value


def _latex_head(column: Column[Any]) -> str:
    unit = rf"\\({_latex(column.unit)})" if column.unit else ""
    return rf"\shortstack{{{_latex(column.heading)}{unit}}}"


def _latex_cell(cell: Cell) -> str:
    if not cell.note:
        return _latex(cell.value)
    return rf"\shortstack[r]{{{_latex(cell.value)}\\{{\tiny {_latex(cell.note)}}}}}"


def _latex(text: str) -> str:
    parts = text.split("--")  # the two hyphens of an option are no dash
    return "-{}-".join("".join(_LATEX.get(letter, letter) for letter in part) for part in parts)


def _csv_row(suite: str, row: Row) -> dict[str, str | float | int | None]:
    def bounds(name: str, interval: Interval | None) -> dict[str, float | None]:
        low, high = interval or (None, None)
        return {f"{name}_low": low, f"{name}_high": high}

    summary = row.summary
    values: dict[str, str | float | int | None] = {
        "suite": suite,
        "contestant": summary.contestant,
        "family": summary.family,
        "members": summary.members,
        "episodes": summary.success.trials,
    }
    for name, estimate in summary.score.items():
        values |= {f"score_{name}": estimate.value, **bounds(f"score_{name}", estimate.interval)}
    values |= bounds("score_iqm_retrained", summary.score_iqm_retrained)
    for name, rate in (("success_rate", summary.success), ("violation_rate", summary.violation)):
        values |= {name: rate.share, **bounds(name, rate.interval)}
    values |= {f"outcome_{outcome}": count for outcome, count in summary.outcomes.items()}
    values["largest_swing_share"] = summary.largest_swing_share
    estimates = {
        "optimum_share_iqm": summary.optimum_share,
        "swing_share_cvar": summary.swing_share_cvar,
        "time_to_goal_iqm_s": summary.time_to_goal_s,
        "path_length_iqm_m": summary.path_length_m,
        "energy_iqm_j": summary.energy_j,
        "force_error_iqm_n": summary.force_error_n,
    }
    for name, value in estimates.items():
        values[name] = None if value is None else value.value
        values |= bounds(name, None if value is None else value.interval)
    return values | {
        "peak_grasp_force_n": summary.peak_grasp_force_n,
        "final_distance_median_m": summary.final_distance_m,
        "intervention_rate": summary.interventions,
        "mean_intervention_m_s2": summary.mean_intervention_m_s2,
        "certificate_applies_rate": summary.certificate_applies,
        "decision_time_s": row.decision_time_s,
        "privileged": row.privileged or NONE,
    }
