"""The tables as text and as files."""

from __future__ import annotations

import csv
import io
import re

import numpy as np
import pytest
from rich.console import Console
from suite_records import suite_records

from defmanip_gym.evaluation.analysis import analyse
from defmanip_gym.evaluation.report.columns import COLUMNS, Row
from defmanip_gym.evaluation.report.exports import latex_table, markdown_table, write_csv
from defmanip_gym.evaluation.report.terminal import terminal_table

COMMAND = "python evaluate.py --output some_where"


def rows_of(matrices):
    analysis = analyse(suite_records(matrices), "nominal", order=list(matrices), certified=[])
    return [
        Row(summary=summary, privileged="knows a|b & c_d", decision_time_s=0.00012)
        for summary in analysis.summaries
    ]


@pytest.fixture(scope="module")
def rows():
    generator = np.random.default_rng(0)
    return rows_of(
        {"ppo/phase_plane": generator.uniform(0.3, 0.5, (5, 12)), "zero": np.zeros((1, 12))}
    )


def test_the_terminal_table_of_seventeen_contestants_fits_120_columns():
    names = [f"ppo-randomized-{letter}/phase_plane"[-26:] for letter in "abcdefghijklmnopq"]
    generator = np.random.default_rng(0)
    rows = rows_of({name: generator.choice((0.0, 0.123), (5, 12)) for name in names})
    buffer = io.StringIO()
    Console(file=buffer, width=120).print(terminal_table("disturbed", rows))
    lines = buffer.getvalue().splitlines()
    assert all(any(name in line for line in lines) for name in names)
    assert "…" not in buffer.getvalue()
    assert max(map(len, map(str.rstrip, lines))) <= 120


def test_csv_has_full_precision_units_and_empty_cells_for_none(rows, tmp_path):
    path = tmp_path / "summary.csv"
    write_csv(path, {"nominal": rows})
    first, second = csv.DictReader(path.open())
    assert first["suite"] == "nominal"
    assert float(first["score_iqm"]) == rows[0].summary.score["iqm"].value
    assert float(first["score_iqm_low"]) < float(first["score_iqm"])
    assert float(first["score_iqm_retrained_low"]) < float(first["score_iqm"])
    assert float(first["success_rate_low"]) < 1.0 == float(first["success_rate"])
    assert second["time_to_goal_iqm_s"] == second["intervention_rate"] == ""
    assert second["outcome_timeout"] == "12"


def test_markdown_rows_have_as_many_cells_as_the_head(rows):
    lines = markdown_table(rows, COMMAND).splitlines()
    table = [line for line in lines if line.startswith("|")]
    cells = {len(re.split(r"(?<!\\)\|", line)) for line in table}
    assert cells == {len(COLUMNS) + 4}
    assert len(table) == 2 + len(rows)
    assert f"`{COMMAND}`" in lines[-1]


def test_latex_rows_have_as_many_cells_as_the_head_and_no_bare_specials(rows):
    text = latex_table("nominal", rows, COMMAND)
    body = [line for line in text.splitlines() if line.endswith(r"\\") and "&" in line]
    assert {len(re.findall(r"(?<!\\)&", line)) for line in body} == {len(COLUMNS) + 1}
    assert len(body) == 1 + len(rows)
    for line in text.splitlines()[1:]:
        assert not re.search(r"(?<!\\)[_#]|(?<!\$)[<>]|--o", line), line
    assert text.isascii() and r"\toprule" in text and r"\bottomrule" in text
    assert text.startswith(f"% Made by: {COMMAND}")
    assert "-{}-output" in text and re.search(r"0\.\d+--0\.\d+", text)
    for opening, closing in (("{", "}"), (r"\begin", r"\end")):
        assert text.count(opening) == text.count(closing)


def test_every_column_says_what_it_is(rows):
    for column in COLUMNS:
        assert column.legend and column.cell(rows[0]).value
