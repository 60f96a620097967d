"""Everything a comparison leaves behind."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from episodes import trace
from PIL import Image
from rich.console import Console
from suite_records import contestant, suite_records

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.outputs import print_results, write_outputs
from defmanip_gym.evaluation.protection import Certificates, protection_named
from defmanip_gym.evaluation.report.columns import COLUMNS

EVIL = "ppo</script><b>"
SEEDS = ("0", "1", "2")


@pytest.fixture(scope="module")
def comparison(tmp_path_factory):
    folder = tmp_path_factory.mktemp("comparison")
    protection = protection_named("l1", Certificates())
    contestants = (
        contestant("tanner", "analytic", description="5 < 6 & <b>so on</b>"),
        contestant("tanner/l1", "analytic", protection=protection),
        contestant(EVIL, "learned", members=SEEDS),
        contestant("ppo/l1", "learned", members=SEEDS, protection=protection),
        contestant("sac", "learned", members=SEEDS),
    )
    generator = np.random.default_rng(0)
    levels = {"ppo/l1": 0.25, "sac": 0.3, EVIL: 0.4, "tanner/l1": 0.2, "tanner": 0.35}
    records = suite_records(
        {
            name: level + generator.normal(0, 0.01, (1 if "tanner" in name else 3, 4))
            for name, level in levels.items()
        }
    )
    for entry in contestants:
        for scenario, duration_s in (("nominal-00", 3.0), ("nominal-01", 2.0)):
            member = entry.members[0].name
            if entry.name != EVIL:  # no name for a file
                trace(entry.name, scenario, duration_s, member=member).save(folder / "traces")
    (folder / "timings.json").write_text('{"tanner": 0.0005}')
    config = ComparisonConfig(output=folder, suites=("nominal",), episodes=4)
    sections, report = write_outputs(config, contestants, records)
    return config, sections, report


@pytest.fixture(scope="module")
def html(comparison):
    return comparison[2].read_text()


def test_rows_are_in_the_order_of_the_contestants(comparison):
    (section,) = comparison[1]
    names = [row.summary.contestant for row in section.rows]
    assert names == ["tanner", "tanner/l1", EVIL, "ppo/l1", "sac"]


def test_report_needs_nothing_but_itself(html):
    sources = re.findall(r"""\s(?:src|href|srcset|action)\s*=\s*["']([^"']*)""", html)
    assert any(source.startswith("data:image/png;base64,") for source in sources)
    assert all(source.startswith(("data:image/png;base64,", "#")) for source in sources)
    for outside in ("http:", "https:", "@import", "url(", "fetch(", "XMLHttpRequest", "import("):
        assert outside not in html


def test_links_within_the_report_lead_somewhere(html):
    targets = set(re.findall(r'href="#([^"]*)"', html))
    assert {"nominal", "contestants", "methods"} <= targets
    assert targets <= set(re.findall(r'id="([^"]*)"', html))


def test_report_escapes_text_and_holds_every_column(html):
    assert "5 &lt; 6 &amp; &lt;b&gt;so on" in html
    assert EVIL not in html
    for column in COLUMNS:
        assert column.heading in html and column.unit in html


def test_every_table_figure_and_animation_names_its_command(comparison, html):
    command = comparison[0].command
    assert command.startswith("python evaluate.py --output")
    made = re.findall(r'<p class="made">[^<]*<code>([^<]*)</code>', html)
    shown = html.count("<table>") + html.count("<figure>") + html.count('class="player"')
    assert len(made) == shown >= 5
    assert set(made) == {command}
    for path in (comparison[0].output / "plots").rglob("*.png"):
        assert Image.open(path).info["Comment"] == f"Made by: {command}"


def test_the_report_begins_with_the_answer_and_its_picture(html):
    answer = html.index("Learning adds ")
    picture = html.index('alt="score of the best analytic and the best learned contestant')
    assert html.index("<h1>") < answer < picture < html.index("<nav")


def test_the_best_of_each_kind_is_shown_and_the_rest_on_demand(html):
    visible = re.sub(r"<details>.*?</details>", "", html, flags=re.DOTALL)
    assert 'alt="phase-tanner+l1 in suite nominal"' in visible
    assert 'alt="phase-sac in suite nominal"' not in visible
    assert 'alt="phase-sac in suite nominal"' in html


def test_animations_hold_both_episodes_from_start_to_end(html):
    (data,) = re.findall(r'<script type="application/json">(.*?)</script>', html)
    scene = json.loads(data)
    assert [episode["name"] for episode in scene["episodes"]] == ["tanner/l1", "ppo/l1"]
    for episode in scene["episodes"]:
        lengths = {len(episode[name]) for name in ("t", "x", "y", "heading", "q1", "q2")}
        assert lengths == {len(episode["phi"][0])}
        assert (episode["t"][0], episode["t"][-1]) == (0.0, 3.0)
        assert (episode["x"][0], episode["x"][-1]) == (-8.0, 0.0)


def test_without_script_the_first_frame_is_there_and_the_controls_are_not(html):
    player = html[html.index('class="player"') : html.index("Animation made by")]
    assert player.count("<svg") == 4  # two contestants, from the side and from above
    assert player.count("<canvas hidden") == 2
    assert '<div class="controls" hidden>' in player


def test_animations_honour_reduced_motion(html):
    assert "prefers-reduced-motion: reduce" in html


def test_decision_times_are_shown_where_they_are_known(comparison):
    (section,) = comparison[1]
    times = {row.summary.contestant: row.decision_time_s for row in section.rows}
    assert times["tanner"] == 0.0005 and times["sac"] is None


def test_printed_results_are_not_cut_off_in_narrow_outputs(comparison, capsys):
    _, sections, report = comparison
    print_results(Console(width=40), sections, report)
    printed = capsys.readouterr().out
    assert "…" not in printed and "Violation %" in printed
    assert "Among all" in printed
    assert str(report.resolve()) in printed


def test_nothing_but_whole_files_is_left(comparison):
    folder = comparison[0].output
    names = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    others = {name for name in names if not name.startswith(("traces/", "plots/nominal/"))}
    assert others == {
        "plots/overview.png",
        "timings.json",
        "summary.csv",
        "report.html",
        "tables/nominal.md",
        "tables/nominal.tex",
        "tables/nominal-filters.md",
        "tables/nominal-filters.tex",
    }
    assert all(name.endswith(".png") for name in names if name.startswith("plots/"))


def test_missing_episodes_are_refused(tmp_path):
    config = ComparisonConfig(output=tmp_path, suites=("nominal",))
    records = suite_records({"tanner": np.full(3, 0.4), "sac": np.full((3, 3), 0.4)})[:-1]
    contestants = (contestant("tanner", "analytic"), contestant("sac", "learned", members=SEEDS))
    with pytest.raises(RecordError, match="run the same command again"):
        write_outputs(config, contestants, records)


def test_a_comparison_without_traces_or_rivals_has_a_report_always_the_same(tmp_path):
    config = ComparisonConfig(output=tmp_path, suites=("nominal",))
    records = suite_records({"zero": np.zeros(3)})

    def written():
        write_outputs(config, (contestant("zero", "reference"),), records)
        return {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}

    first = written()
    assert "nobody reached the goal within σ" in first[tmp_path / "report.html"].decode()
    assert written() == first
