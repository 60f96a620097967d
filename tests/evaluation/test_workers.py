"""Jobs in other processes: the same records, and nothing lost or left behind when stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from defmanip_gym.evaluation import comparison
from defmanip_gym.evaluation.config import ComparisonConfig

SCRIPT = """
import sys
from pathlib import Path
from defmanip_gym.evaluation import comparison
comparison.write_outputs = lambda config, contestants, records: ((), config.output / "report.html")
comparison.print_results = lambda *_: None
comparison.run_comparison(
    comparison.ComparisonConfig(
        output=Path(sys.argv[1]),
        jobs=int(sys.argv[2]),
        suites=("all",),
        episodes=1,
        contestants=("zero", "random"),
    )
)
"""


def start(output, processes):
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(output), str(processes)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # shells start background jobs with it ignored, and children inherit that
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*.jsonl")}


def wait_for_a_file(folder, process):
    while not files(folder):
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)


def relatives(group):
    """Return the processes of a group that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, process_group = stat.read_text().rpartition(")")[2].split()[:3]
        except OSError:  # it has just ended
            continue
        if int(process_group) == group and state != "Z":
            found.append(stat.parent.name)
    return found


def wait_until_alone(process):
    patience = time.monotonic() + 30.0  # they are being ended, not necessarily gone
    while relatives(process.pid):
        assert time.monotonic() < patience, relatives(process.pid)
        time.sleep(0.05)


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_stopped_in_two_ways_a_comparison_still_ends_with_the_same_records(tmp_path, monkeypatch):
    here, there = tmp_path / "here", tmp_path / "parallel"
    monkeypatch.setattr(comparison, "write_outputs", lambda *_: ((), here))
    monkeypatch.setattr(comparison, "print_results", lambda *_: None)
    # first, since it keeps the machine code that the others would tell of compiling
    comparison.run_comparison(
        ComparisonConfig(
            output=here, jobs=1, suites=("all",), episodes=1, contestants=("zero", "random")
        )
    )

    process = start(there, 2)
    wait_for_a_file(there, process)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Go on by running" in " ".join(output.split()) and errors == ""
    wait_until_alone(process)
    kept = files(there)

    process = start(there, 2)
    wait_for_a_file(there, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    assert files(there).items() >= kept.items()

    process = start(there, 2)
    wait_for_a_file(there, process)
    process.kill()  # it alone
    process.communicate(timeout=60)
    wait_until_alone(process)

    process = start(there, 2)
    _, errors = process.communicate(timeout=300)
    assert (process.returncode, errors) == (0, "")
    assert files(there) == files(here) and len(files(here)) == 12
