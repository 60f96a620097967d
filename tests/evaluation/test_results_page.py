"""docs/results.md is made of a benchmark's files alone."""

from __future__ import annotations

import importlib.util
import re
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from suite_records import contestant, suite_records

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.outputs import write_outputs
from defmanip_gym.evaluation.protection import Certificates, protection_named
from defmanip_gym.evaluation.store import RecordFolder

SCRIPT = Path(__file__).parents[2] / "docs" / "make_results.py"
SEEDS = ("0", "1", "2")
LEVELS = {"tanner": 0.3, "tanner/l1": 0.2, "ppo": 0.4, "ppo/l1": 0.25}


@pytest.fixture(scope="module")
def write_results():
    spec = importlib.util.spec_from_file_location("make_results", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.write_results


def store(folder, records):
    def key(record):
        return record.suite, record.contestant, record.family, record.member

    for (suite, name, family, member), own in groupby(sorted(records, key=key), key):
        entry = Entry(suite=suite, contestant=name, family=family, member=member)
        RecordFolder(folder / "records").write(entry, "any", tuple(own))


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    folder = tmp_path_factory.mktemp("benchmark")
    generator, records = np.random.default_rng(0), []
    for suite, conditions in (("nominal", ["nominal"] * 4), ("mismatch", ["a", "a", "b", "b"])):
        matrices = {
            name: level + generator.normal(0, 0.01, (1 if "tanner" in name else 3, 4))
            for name, level in LEVELS.items()
        }
        records += suite_records(matrices, suite=suite, conditions=conditions)
    protection = protection_named("l1", Certificates())
    contestants = [
        contestant(
            name,
            "analytic" if "tanner" in name else "learned",
            members=("-",) if "tanner" in name else SEEDS,
            protection=protection if "/" in name else None,
        )
        for name in LEVELS
    ]
    store(folder, records)
    (folder / "timings.json").write_text('{"tanner": 0.123456}')
    config = ComparisonConfig(output=folder, suites=("nominal", "mismatch"), episodes="all")
    sections, _ = write_outputs(config, contestants, records)
    return folder, config, sections


@pytest.fixture(scope="module")
def page(benchmark, write_results, tmp_path_factory):
    return write_results(benchmark[0], tmp_path_factory.mktemp("docs"))


def test_every_suite_has_its_sentences_tables_and_two_figures(benchmark, page):
    text = page.read_text()
    for section in benchmark[2]:
        own = text.split(f"## {section.suite}\n")[1].split("\n## ")[0]
        assert all(claim.text in own for claim in section.claims)
        assert all(f"| {name} |" in own for name in LEVELS)
        second = "conditions" if section.suite == "mismatch" else "profiles"
        names = [f"images/results/{section.suite}-{name}.png" for name in ("forest", second)]
        assert re.findall(r"\]\((images/[^)]*)\)", own) == names
        assert own.count(f"Made by `{benchmark[1].command}`") == 4


def test_its_first_sentence_says_what_learning_adds(page):
    assert page.read_text().startswith("# Results\n\nLearning adds something on ")


def test_images_that_it_shows_exist(page):
    for target in re.findall(r"\]\((images/[^)]*)\)", page.read_text()):
        assert (page.parent / target).stat().st_size > 0


def test_it_holds_no_wall_times_but_all_other_columns(page):
    text = page.read_text()
    assert "Decision" not in text and "| 0.12 |" not in text
    assert "Energy (J)" in text and "| Knows |" in text
    assert "Chattering (1/s)" in text
    tables = re.findall(r"(?:^\|.*\n)+", text, re.M)
    assert len(tables) == 4  # two suites, contestants and filters
    for table in tables:
        assert len({len(re.split(r"(?<!\\)\|", row)) for row in table.splitlines()}) == 1


def test_broken_certificates_are_told(benchmark, page, write_results, tmp_path):
    assert "σ was exceeded in none of them" in page.read_text()
    records = suite_records({"tanner/l1": np.full(3, 0.2)})
    bad = {"outcome": "violation", "success": False, "violated": True}
    records[0] = replace(records[0], **bad, time_to_goal_s=None)
    config = replace(benchmark[1], output=tmp_path / "b", suites=("nominal",))
    who = contestant("tanner/l1", "analytic", protection=protection_named("l1", Certificates()))
    write_outputs(config, [who], records)
    store(tmp_path / "b", records)
    text = write_results(tmp_path / "b", tmp_path).read_text()
    assert "Filters covered 3 of 3 episodes; σ was exceeded in 1 of them." in text


def test_no_benchmark_or_one_with_other_records_by_now_is_refused(
    benchmark, write_results, tmp_path
):
    with pytest.raises(RecordError, match="make benchmark"):
        write_results(tmp_path, tmp_path)
    more = suite_records({"ppo": np.full((4, 4), 0.4)})[12:]
    store(benchmark[0], more)
    with pytest.raises(RecordError, match="16.*12, as in the tables"):
        write_results(benchmark[0], tmp_path)
