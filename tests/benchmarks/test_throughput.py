"""The benchmark runs; its figures are not asserted: they belong to the machine."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.fixture
def run(tmp_path):
    """Run the benchmark in an empty folder with very short turns."""

    def run(words):
        ended = subprocess.run(
            [
                sys.executable,
                ROOT / "benchmarks" / "speed" / "throughput.py",
                *words.split(),
                *"--rounds 2 --turn-s 0.01".split(),
            ],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert ended.returncode == 0, ended.stderr
        return ended.stdout

    return run


def test_make_vec_is_compared_with_the_physics_alone(run):
    assert re.search(
        r"make_vec n=16 force .* × physics n=16", run("--sections batch --num-envs 2 16")
    )


def test_figures_are_written_with_their_spread(run, tmp_path):
    run("--sections core --json figures.json")
    figures = json.loads((tmp_path / "figures.json").read_text())["sections"]["core"]
    assert any("mj_step on one core" in figure["unit"] for figure in figures)
    assert all(0 < figure["low"] <= figure["value"] <= figure["high"] for figure in figures)


def test_physics_beyond_is_compared_with_gymnasiums_environments(run, tmp_path):
    printed = run("--sections marks --control-modes force")
    assert re.search(r"DeformTransport-v0 force beyond physics .* × Hopper-v5's", printed)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_make_vec_is_compared_with_worker_processes(run):
    pytest.importorskip("stable_baselines3")
    assert re.search(
        r"make_vec\(64\) .* × SubprocVecEnv\(1\)", run("--sections vector --workers 1")
    )


def test_memory_is_measured_for_each_environment(run):
    printed = run("--sections memory --control-modes force --memory-envs 64")
    assert re.search(r"make_vec\(64\) force, built .* KiB per env", printed)


def test_segments_are_compared_with_the_first_count(run):
    printed = run("--sections segments --control-modes force --segment-counts 1 2")
    assert re.search(r"time of force N=2 .* × force N=1", printed)


def test_a_missing_envpool_is_named_with_its_remedy(run):
    printed = run("--sections envpool")
    assert "EnvPool HalfCheetah" in printed or "'.[bench]'" in printed
