"""The benchmark runs; its figures are not asserted: they belong to the machine."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent


def test_throughput_prints_ratios_to_the_physics():
    words = "--num-envs 2 16 --rounds 2 --turn-s 0.02 --no-outside".split()
    ended = subprocess.run(
        [sys.executable, "benchmarks/throughput.py", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stderr
    assert re.search(r"make_vec n=16 .* of physics n=16", ended.stdout)
