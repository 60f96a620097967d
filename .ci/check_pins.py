"""Ask the public index, without this machine's pip settings, for what constraints.txt pins.

``python .ci/check_pins.py [constraints.txt]`` resolves the dependencies of the core, all of which
must be pinned, and looks up every other pin. Nothing is installed, and of wheels only the metadata
is read. Exit status: 0 all is served, or the index could not be asked, which is said; 1 otherwise.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
KEPT_SETTINGS = ("PIP_CERT", "PIP_PROXY", "PIP_DEFAULT_TIMEOUT")  # how to reach an index, not which
LIMIT_S = 240.0
CONNECTION_TROUBLE = re.compile(
    r"Retrying|Connection|timed? ?out|HTTP error|HTTPError|SSLError|Max retries", re.I
)


class IndexUnreachable(Exception):
    """The index gave no answer, which says nothing about the pins."""


def pip(*words: str, path: Path | None, deadline: float) -> subprocess.CompletedProcess[str]:
    """Run pip, the one in ``path`` if given, without the settings of user and machine."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if (not name.startswith("PIP_") or name in KEPT_SETTINGS) and name != "PYTHONPATH"
    }
    environment |= {"PIP_CONFIG_FILE": os.devnull, "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    if path is not None:
        environment["PYTHONPATH"] = str(path)
    try:
        answer = subprocess.run(
            [sys.executable, "-m", "pip", *words],
            env=environment,
            capture_output=True,
            text=True,
            timeout=max(deadline - time.monotonic(), 1.0),
        )
    except subprocess.TimeoutExpired as error:
        raise IndexUnreachable(f"no answer after {LIMIT_S:.0f} s in all") from error
    if answer.returncode and CONNECTION_TROUBLE.search(answer.stdout + answer.stderr):
        raise IndexUnreachable(answer.stderr.strip().splitlines()[-1])
    return answer


def normal(name: str) -> str:
    """Return the name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def resolved(folder: Path, deadline: float, *words: str) -> dict[str, str]:
    """Return name and version of what pip would install; ends the program where it cannot."""
    report = folder / "report.json"
    dry = ("install", "--dry-run", "--ignore-installed", "--quiet", "--report", str(report))
    answer = pip(*dry, *words, path=folder / "pip", deadline=deadline)
    if answer.returncode:
        sys.exit(f"The public index cannot serve this:\n{answer.stderr.strip()}")
    metadata = [item["metadata"] for item in json.loads(report.read_text())["install"]]
    return {normal(entry["name"]): entry["version"] for entry in metadata}


def check(constraints: Path, folder: Path) -> str:
    """Return what was found; ends the program at a pin that is missing or not served."""
    deadline = time.monotonic() + LIMIT_S
    pins = {
        normal(line.split("==")[0]): line.strip()
        for line in constraints.read_text().splitlines()
        if "==" in line
    }
    # Older releases of pip download wheels in dry runs
    fresh = ("install", "--quiet", "--no-compile", "--target", str(folder / "pip"), "pip>=23.3")
    if pip(*fresh, path=None, deadline=deadline).returncode:
        raise IndexUnreachable("pip itself could not be fetched")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    core = resolved(folder, deadline, "--constraint", str(constraints), *project["dependencies"])
    if unpinned := sorted(set(core) - set(pins)):
        sys.exit(f"The core installs what {constraints.name} does not pin: {', '.join(unpinned)}.")
    others = [pin for name, pin in pins.items() if name not in core]
    resolved(folder, deadline, "--no-deps", *others)
    return f"The core's {len(core)} distributions are pinned, and all {len(pins)} pins are served."


def main() -> None:
    """Check the file named on the command line, or the project's."""
    constraints = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "constraints.txt"
    with tempfile.TemporaryDirectory() as folder:
        try:
            print(check(constraints, Path(folder)))
        except IndexUnreachable as error:
            print(f"Pins were not checked, as the index could not be asked: {error}")


if __name__ == "__main__":
    main()
