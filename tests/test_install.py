"""Installation: the Pythons that work are found, and the citation names the version."""

import importlib
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


def write_pythons(folder, answers):
    """Write programs that say which Python they are."""
    folder.mkdir(parents=True)
    for name, answer in answers.items():
        (folder / name).write_text(f"#!/bin/sh\necho {answer}\n")
        (folder / name).chmod(0o755)


@pytest.fixture
def pythons(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / ".ci")
    return importlib.import_module("pythons").pythons


def test_each_supported_python_is_found_once_on_the_path_and_among_pyenvs(
    pythons, tmp_path, monkeypatch
):
    on_path, root = tmp_path / "bin", tmp_path / "pyenv"
    others = {"python3.9": "cpython 3 9 /old", "python3.13-config": "cpython 3 13 /no/python"}
    main = {"python3.11": "cpython 3 11 /a", "python3": "cpython 3 11 /same", "pyenv": root}
    write_pythons(on_path, {**others, **main, "python3.12": "pypy 3 12 /pypy"})
    write_pythons(root / "versions" / "3.14.0" / "bin", {"python3": "cpython 3 14 /c"})
    monkeypatch.setenv("PATH", str(on_path))
    found = [(python.name, str(python.program)) for python in pythons([])]
    assert found == [("3.11", "/same"), ("3.14", "/c")]


@pytest.mark.parametrize("answer", ["cpython 3 10 /old", "nothing of the kind"])
def test_a_named_program_that_is_no_supported_python_is_told(answer, pythons, tmp_path):
    write_pythons(tmp_path / "bin", {"mine": answer})
    with pytest.raises(SystemExit, match=r"mine is no Python 3\.11"):
        pythons([str(tmp_path / "bin" / "mine")])


def test_the_citation_names_the_package_as_it_is():
    citation = pytest.importorskip("yaml").safe_load((ROOT / "CITATION.cff").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation["title"] == project["name"]
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"]
