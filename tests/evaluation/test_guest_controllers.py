"""Anybody's controller takes part like ours: the example of docs/evaluation.md, word for word."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from defmanip_gym.errors import ActionError, ParameterError
from defmanip_gym.evaluation import comparison
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestants import standard_contestants
from defmanip_gym.evaluation.protection import Certificates

PAGE = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text()
EXAMPLE = re.search(r"```python\n(.*?)```", PAGE, re.S)[1]
NAMES = ("my_controller:make_controller", "my_controller:make_controller/storage")


@pytest.fixture
def example(tmp_path, monkeypatch):
    """Put the example into a working directory of its own and return its file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    monkeypatch.delitem(sys.modules, "my_controller", raising=False)
    path = tmp_path / "my_controller.py"
    path.write_text(EXAMPLE)
    return path


@pytest.fixture
def recorded(monkeypatch):
    """Return the records of the last comparison, and skip what is made of them."""
    kept = []

    def keep(config, contestants, records):
        kept[:] = records
        return (), config.output / "report.html"

    monkeypatch.setattr(comparison, "write_outputs", keep)
    monkeypatch.setattr(comparison, "measured_timings", lambda path, contestants: {})
    monkeypatch.setattr(comparison, "measured_filter_times", lambda path, protections: {})
    return kept


def run(folder, names=NAMES, jobs=1):
    comparison.run_comparison(
        ComparisonConfig(
            output=folder, suites=("nominal",), episodes=2, contestants=names, jobs=jobs
        )
    )


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_example_arrives_alone_and_inside_the_filter(example, recorded, tmp_path, jobs):
    run(tmp_path / "results", jobs=jobs)
    assert {record.contestant for record in recorded} == set(NAMES)
    assert {record.family for record in recorded} == {"guest"}
    assert all(record.time_to_goal_s for record in recorded)
    assert all(record.certificate_applies for record in recorded if "/" in record.contestant)


def test_finished_episodes_are_not_run_again_unless_the_source_changes(
    example, recorded, tmp_path, monkeypatch
):
    run(tmp_path / "results", NAMES[:1])
    monkeypatch.setattr(comparison, "running", lambda jobs, count: pytest.fail("ran again"))
    if (jobs := _missing(tmp_path / "results")) != 0:
        pytest.fail(f"{jobs} jobs would run again")
    example.write_text(EXAMPLE.replace("0.3 *", "0.2 *"))
    with pytest.raises(Exception, match="another|other"):
        _missing(tmp_path / "results")


def _missing(folder):
    config = ComparisonConfig(output=folder, suites=("nominal",), episodes=2, contestants=NAMES[:1])
    contestants = standard_contestants(NAMES[:1], Certificates())
    records = comparison.RecordFolder(folder / comparison.RECORD_FOLDER)
    work = comparison.assignments(config, contestants, records)
    return sum(bool(assignment.job.suite.scenarios) for assignment in work)


def test_a_filter_that_there_is_not_is_refused(example):
    with pytest.raises(ParameterError, match="'storage'"):
        standard_contestants([f"{NAMES[0]}/strage"], Certificates())


def test_actions_of_another_shape_are_refused(example, recorded, tmp_path):
    example.write_text(EXAMPLE.replace("return np.clip(w", "return np.clip(w[:, :2]"))
    with pytest.raises(ActionError, match=r"\(2, 2\).*\(2, 3\)"):
        run(tmp_path / "results", NAMES[:1])
