"""The Pythons on this machine that the package supports, one for each minor version."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ASKED = (
    "import sys, venv, ensurepip;"
    "print(sys.implementation.name, *sys.version_info[:2], sys._base_executable)"
)


@dataclass(frozen=True, kw_only=True)
class Python:
    """An interpreter, by the program that makes its environments."""

    version: tuple[int, int]
    program: Path

    @property
    def name(self) -> str:
        """Return the minor version as people write it."""
        return ".".join(map(str, self.version))

    def environment(self, folder: Path, *requirements: str) -> Path:
        """Make an environment with what is named, at the pinned versions; return its programs."""
        subprocess.run([self.program, "-m", "venv", folder], check=True)
        pip = [str(folder / "bin" / "python"), "-m", "pip", "install", "--quiet"]
        pins = ["--constraint", str(ROOT / "constraints.txt")]
        answer = subprocess.run(
            [*pip, *pins, *requirements], cwd=ROOT, capture_output=True, text=True, check=False
        )
        if answer.returncode:
            sys.exit(f"Python {self.name} cannot install this:\n{answer.stderr.strip()}")
        return folder / "bin"


def oldest() -> tuple[int, int]:
    """Return the oldest version that ``requires-python`` allows."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    major, minor = re.findall(r"\d+", project["requires-python"])
    return int(major), int(minor)


def candidates() -> list[str]:
    """Return programs on the path that are called Python, then pyenv's, selected or not."""
    folders = [Path(folder) for folder in os.environ.get("PATH", "").split(os.pathsep)]
    if shutil.which("pyenv"):
        answer = subprocess.run(["pyenv", "root"], capture_output=True, text=True, check=False)
        folders += sorted(Path(answer.stdout.strip()).glob("versions/*/bin"))
    return [
        str(path)
        for folder in folders
        if folder.is_dir()
        for path in sorted(folder.iterdir())
        if re.fullmatch(r"python3(\.\d+)?", path.name)
    ]


def asked(program: str) -> Python | None:
    """Run a program; return None if it is no CPython that can make environments."""
    try:
        answer = subprocess.run(
            [program, "-c", ASKED], capture_output=True, text=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    if answer.returncode or not answer.stdout.startswith("cpython "):
        return None
    _, major, minor, path = answer.stdout.strip().split(maxsplit=3)
    return Python(version=(int(major), int(minor)), program=Path(path))


def pythons(programs: list[str]) -> list[Python]:
    """Return the named Pythons, or all that are found; ends the program where there is none."""
    found: dict[tuple[int, int], Python] = {}
    for program in programs or candidates():
        python = asked(program)
        if python is not None and python.version >= oldest():
            found.setdefault(python.version, python)
        elif programs:
            sys.exit(f"{program} is no Python {'.'.join(map(str, oldest()))} or newer with venv.")
    if not found:
        sys.exit("No Python that the package supports is on the path or among pyenv's.")
    return [found[version] for version in sorted(found)]
