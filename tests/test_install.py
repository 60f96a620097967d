"""Installation: the Makefile finds a Python that works, and the citation names the version."""

import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORKS = "#!/bin/sh\nif [ $1 = -c ]; then exit 0; fi\necho made by ${0##*/}\n"
SHIM_OF_NOTHING = "#!/bin/sh\necho command not found >&2\nexit 127\n"


def make_environment(folder, pythons, *words):
    """Return make's answer on a path that holds the given programs alone."""
    path = folder / "bin"
    path.mkdir()
    for name, text in pythons.items():
        (path / name).write_text(text)
        (path / name).chmod(0o755)
    venv = folder / "venv"
    return subprocess.run(
        [shutil.which("make"), f"VENV={venv}", *words, f"{venv}/bin/python"],
        env={"PATH": str(path)},
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize(
    ("pythons", "chosen"),
    [
        ({"python3.11": WORKS, "python3.12": WORKS}, "python3.11"),
        ({"python3.11": SHIM_OF_NOTHING, "python3.12": WORKS}, "python3.12"),
        ({"python3": WORKS}, "python3"),
    ],
)
def test_the_first_python_that_runs_makes_the_environment(pythons, chosen, tmp_path):
    answer = make_environment(tmp_path, pythons)
    assert answer.returncode == 0, answer.stderr
    assert f"made by {chosen}\n" in answer.stdout


def test_a_named_python_comes_before_all_others(tmp_path):
    pythons = {"python3.11": WORKS, "mine": WORKS}
    assert "made by mine\n" in make_environment(tmp_path, pythons, "PYTHON=mine").stdout


@pytest.mark.parametrize("words", [(), ("PYTHON=python3.11",)])
def test_without_a_python_make_says_what_is_missing(words, tmp_path):
    answer = make_environment(tmp_path, {"python3.11": SHIM_OF_NOTHING}, *words)
    assert answer.returncode != 0
    assert "Python 3.11 or newer" in answer.stderr
    assert "PYTHON=" in answer.stderr


def test_the_citation_names_the_package_as_it_is():
    citation = pytest.importorskip("yaml").safe_load((ROOT / "CITATION.cff").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation["title"] == project["name"]
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"]
