"""Run the tests that need no torch with every Python that is supported.

``python .ci/test_core.py [--workers N] [python ...]`` installs the project without training into
an empty environment of each Python named, by default of each one found, and runs pytest there, in
N processes at once. Exit status: 0 where all tests pass, 1 otherwise.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from pythons import ROOT, Python, pythons


def outcome(python: Python, folder: Path, workers: int) -> tuple[bool, str]:
    """Return whether the tests pass, and pytest's last line."""
    programs = python.environment(folder, "--editable", ".[test]")
    there = "import importlib.util, sys; sys.exit(importlib.util.find_spec('torch') is not None)"
    if subprocess.run([programs / "python", "-c", there], check=False).returncode:
        sys.exit("The core's tests installed torch, which belongs to training.")
    print(f"Python {python.name}", flush=True)
    pytest = [str(programs / "python"), "-m", "pytest", "--numprocesses", str(workers)]
    answer = subprocess.Popen(pytest, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    line = ""
    for line in answer.stdout or ():
        print(line, end="", flush=True)
    return answer.wait() == 0, line.strip()


def main() -> None:
    """Test with the Pythons named on the command line, or with all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--workers", type=int, default=2, help="processes; 0: this one")
    parser.add_argument("python", nargs="*", help="names or paths; default: all that are found")
    words = parser.parse_args()
    outcomes = {}
    with tempfile.TemporaryDirectory() as folder:
        for python in pythons(words.python):
            outcomes[python.name] = outcome(python, Path(folder) / python.name, words.workers)
    print()
    for name, (_, line) in outcomes.items():
        print(f"Python {name}: {line}")
    if not all(passed for passed, _ in outcomes.values()):
        sys.exit("The core's tests do not pass everywhere: see above.")


if __name__ == "__main__":
    main()
