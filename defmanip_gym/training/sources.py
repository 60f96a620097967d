"""A digest of the source files that a training depends on, for the cards of its agents."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_PACKAGE = "defmanip_gym"
_ROOT = Path(__file__).parents[1]
# a residual corrects any of them; entry points lead there, not imports
_BY_NAME = ("baselines.analytic",)
_START = "training.train"


@cache
def sources_digest() -> str:
    """Return sixteen hexadecimal digits that change with any file that training imports.

    Followed are the imports of the package's own modules, from the training loop and from the
    controllers that residuals can correct. Scores, pages and the commands that training does not
    need may change without it.
    """
    digest = hashlib.sha256()
    for path in training_files():
        digest.update(path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def training_files() -> tuple[Path, ...]:
    """Return the package's files that a training imports, directly or not, in order."""
    waiting = [_ROOT / f"{_START.replace('.', '/')}.py"]
    waiting += [path for room in _BY_NAME for path in (_ROOT / room.replace(".", "/")).glob("*.py")]
    found: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imported(path)
    return tuple(sorted(found))


def _imported(path: Path) -> Iterator[Path]:
    """Yield the package's files that a file imports, those of its functions, too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            first, *rest = name.split(".")
            if first == _PACKAGE:
                yield from _files(_ROOT.joinpath(*rest))


def _files(module: Path) -> Iterator[Path]:
    for path in (module.with_suffix(".py"), module / "__init__.py"):
        if path.is_file():
            yield path
