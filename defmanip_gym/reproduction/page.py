"""The page: table, figures, and what the paper leaves open; made from the numbers alone."""

from __future__ import annotations

import json
import math
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from defmanip_gym.files import write_atomically
from defmanip_gym.reproduction.parts import Numbers

NUMBERS_FILE = "numbers.json"


def render_page(numbers: Numbers, *, image_folder: str = "") -> str:
    """Return the page in Markdown.

    Args:
        numbers: of all parts, as in numbers.json.
        image_folder: where the images lie as seen from the page, with a slash at its end.
    """
    environment = Environment(
        loader=PackageLoader("defmanip_gym.reproduction"),
        autoescape=False,  # Markdown from numbers, nothing that anybody typed
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "fixed": lambda value, digits: f"{value:.{digits}f}".replace("-", "−"),
        "short": _short,
        "scientific": _scientific,
        "degrees": math.degrees,
    }
    template = environment.get_template("reproduction.md.j2")
    return template.render(numbers=numbers, images=image_folder)


def write_page(folder: Path, numbers: Numbers) -> Path:
    """Write numbers.json and reproduction.md; return the page's path."""
    text = json.dumps(numbers, indent=1, allow_nan=False) + "\n"
    write_atomically(folder / NUMBERS_FILE, text.encode("utf-8"))
    page = folder / "reproduction.md"
    write_atomically(page, render_page(numbers).encode("utf-8"))
    return page


def _scientific(value: float, digits: int = 1) -> str:
    sign = "−" if value < 0 else ""
    return sign + f"{abs(value):.{digits}e}".replace("e-0", "e-")


def _short(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")
