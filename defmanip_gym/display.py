"""What commands share when they show something: figures as files and a progress bar."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from defmanip_gym.files import write_atomically

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.figure import Figure

DPI = 140


def save_figure(path: Path, figure: Figure, *, dpi: int = DPI) -> None:
    """Write a figure as PNG, without date or version: the same figure is the same file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    write_atomically(path, buffer.getvalue())


def progress_bar(console: Console) -> Progress:
    """Return a progress display with a line for each task."""
    return Progress(
        TextColumn("{task.description:<16}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
    )
