from __future__ import annotations

import csv
import re

import pytest
from episodes import record, trace
from rich.console import Console

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestants import Contestant
from defmanip_gym.evaluation.outputs import print_results, write_outputs
from defmanip_gym.evaluation.plots import PLOTS
from defmanip_gym.evaluation.statistics import summarize
from defmanip_gym.evaluation.table import COLUMNS, write_csv

CONTESTANTS = tuple(
    Contestant(
        name=name,
        description="5 < 6 & <b>so on</b>",
        privileged="nothing",
        colour=colour,
        build=lambda seeds: ZeroController(),
    )
    for name, colour in (("a", "#aa0000"), ("b/l1", "#00aa00"))
)


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    folder = tmp_path_factory.mktemp("comparison")
    (folder / "traces").mkdir()
    for name, duration_s in (("a", 1.0), ("b/l1", 10.0)):
        trace(name, "paper", duration_s).save(folder / "traces")
    records = [
        record(contestant="b/l1", interventions=0.5, mean_intervention_m_s2=0.1),
        record(outcome="timeout", success=False, time_to_goal_s=None),
    ]
    config = ComparisonConfig(output=folder, episodes=1)
    summaries, report = write_outputs(config, CONTESTANTS, records)
    return summaries, report


def test_rows_are_in_the_order_of_the_contestants(output):
    assert [summary.contestant for summary in output[0]] == ["a", "b/l1"]


def test_report_needs_nothing_but_itself(output):
    html = output[1].read_text()
    sources = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)""", html)
    assert len(sources) == len(PLOTS)
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert "http" not in html and "@import" not in html and "url(" not in html


def test_report_escapes_text_and_holds_every_column(output):
    html = output[1].read_text()
    assert "5 &lt; 6 &amp; &lt;b&gt;so on" in html
    for column in COLUMNS:
        assert column.title in html


def test_report_says_how_to_make_it_again(output):
    assert f"python evaluate.py --output {output[1].parent} --episodes 1" in output[1].read_text()


def test_printed_table_is_not_cut_off_in_narrow_outputs(output, capsys):
    print_results(Console(width=40), *output)
    printed = capsys.readouterr().out
    assert "…" not in printed
    assert "Violations" in printed and "Interventions" in printed
    assert str(output[1].resolve()) in printed


def test_csv_has_numbers_with_units_and_empty_cells_for_none(tmp_path):
    path = tmp_path / "summary.csv"
    write_csv(path, summarize([record(), record(scenario="s2", duration_s=20.0)]))
    (row,) = csv.DictReader(path.open())
    assert float(row["time_to_goal_median_s"]) == 15.0
    assert float(row["success_rate_low"]) < 1.0 == float(row["success_rate"])
    assert row["intervention_rate"] == ""
    assert row["outcome_success"] == "2"


def test_nothing_but_whole_files_is_left(output):
    names = {path.name for path in output[1].parent.rglob("*") if path.is_file()}
    plots = {f"{plot.name}.png" for plot in PLOTS}
    assert names == {"a.paper.npz", "b-l1.paper.npz", "summary.csv", "report.html"} | plots
