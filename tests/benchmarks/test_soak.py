"""A short soak passes, and what it must find is found."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parent.parent.parent / "benchmarks" / "speed"


@pytest.fixture(autouse=True)
def benchmarks_importable(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(BENCHMARKS)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def short():
    from soak import SoakConfig

    return SoakConfig(
        steps=3000, num_envs=8, segment_counts=(1, 2), stretch=5, warm_up_cycles=1, num_threads=1
    )


def test_a_short_soak_finds_no_problem(short):
    from soak import soak

    report = soak(short)
    assert report.problems == []
    assert report.steps >= short.steps
    assert report.episodes > 0
    assert np.isfinite(report.growth_mib)


def test_native_output_and_log_files_are_problems(short, monkeypatch):
    import soak

    def write(*_):
        os.write(2, b"WARNING: from native code\n")
        Path(soak.MUJOCO_LOG).write_text("WARNING")

    monkeypatch.setattr(soak, "_run", write)
    problems = soak.soak(short).problems
    assert any("from native code" in problem for problem in problems)
    assert any(soak.MUJOCO_LOG in problem for problem in problems)


def test_growing_memory_is_a_problem(short, monkeypatch):
    import soak

    sizes = iter(range(0, 10**9, 100))
    monkeypatch.setattr(soak, "resident_mib", lambda: float(next(sizes)))
    assert any("memory grew" in problem for problem in soak.soak(short).problems)


def test_values_that_are_not_finite_are_named():
    from soak import not_finite

    info = {"cost": np.zeros(2), "final_info": {"margin": np.array([0.0, np.nan])}}
    assert list(not_finite({"reward": np.array([np.inf]), "info": info})) == [
        "reward",
        "info.final_info.margin",
    ]


def test_the_command_reports_success_by_its_exit_code(tmp_path):
    words = "--steps 500 --num-envs 4 --segment-counts 1 --stretch 2 --num-threads 1".split()
    ended = subprocess.run(
        [sys.executable, BENCHMARKS / "soak.py", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "failed simulations" in ended.stdout
