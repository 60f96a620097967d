"""The benchmark runs; its figures are not asserted: they belong to the machine."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")

BENCHMARKS = Path(__file__).parent.parent.parent / "benchmarks" / "speed"


def test_rollouts_and_updates_of_all_setups_are_timed(tmp_path):
    words = (
        "--rollout-steps 8 --steps 8 --off-policy-steps 4 --learning-starts 16 --rounds 1 "
        "--json figures.json"
    )
    ended = subprocess.run(
        [sys.executable, BENCHMARKS / "training.py", *words.split()],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert ended.returncode == 0, ended.stderr
    results = json.loads((tmp_path / "figures.json").read_text())["sections"]
    for algo in ("ppo", "sac"):
        figures = {figure["name"]: figure for figure in results[algo]}
        assert len(figures) == len(results[algo])  # every name once
        assert figures["speed of ours"]["value"] > 0
        assert figures[f"{algo.upper()} ours: time in updates"]["value"] > 0
        assert figures[f"{algo.upper()} default: time in rollouts"]["value"] > 0
