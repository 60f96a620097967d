"""Every function and test that docs/paper_map.md names exists."""

import importlib
import re
from functools import reduce
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "docs" / "paper_map.md").read_text(encoding="utf-8")
FUNCTIONS = sorted(set(re.findall(r"`(defmanip_gym\.[\w.]+)`", TEXT)))
TESTS = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", TEXT)))


@pytest.mark.parametrize("dotted", FUNCTIONS)
def test_named_function_exists(dotted):
    parts = dotted.split(".")
    depth = next(i for i, part in enumerate(parts) if i >= 2 and not _is_module(parts[: i + 1]))
    module = importlib.import_module(".".join(parts[:depth]))
    assert callable(reduce(getattr, parts[depth:], module))


def _is_module(parts):
    path = ROOT.joinpath(*parts)
    return path.with_suffix(".py").exists() or path.is_dir()


@pytest.mark.parametrize(("path", "name"), TESTS)
def test_named_test_exists(path, name):
    source = (ROOT / path).read_text(encoding="utf-8")
    assert re.search(rf"^def {name}\(", source, re.MULTILINE)


def test_every_row_names_a_function_and_a_test_or_says_not_yet():
    rows = [line.split("|")[1:-1] for line in TEXT.splitlines() if line.startswith("| ")][2:]
    assert len(rows) > 30
    for equation, function, test, _ in rows:
        assert "`defmanip_gym." in function or "not yet" in function, equation
        assert "`tests/" in test or "not yet" in test, equation
