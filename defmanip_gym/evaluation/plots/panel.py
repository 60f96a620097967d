"""What all panels share: size, type, axes without clutter, and PNG files that say who made them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image
from PIL.PngImagePlugin import PngInfo

Colours = Mapping[str, str]

WIDTH_IN = 3.75  # 360 CSS pixels: a phone's
INK, SOFT, FAINT, BAND, BOUND = "#333333", "#777777", "#d9d9d9", "#e8f3ec", "#6a9c7d"
_DPI = 192
_PALETTE = 256  # colours; a panel of lines needs no more, and is a third of the size
_INCH_PX = 96


def panel(
    height_in: float, *, left: float = 0.5, bottom: float = 0.42, top: float = 0.28
) -> tuple[Figure, Axes]:
    """Return a figure with one pair of axes; margins in inches."""
    figure = Figure(figsize=(WIDTH_IN, height_in), dpi=_DPI)
    axes = figure.add_axes(
        (
            left / WIDTH_IN,
            bottom / height_in,
            (WIDTH_IN - left - 0.12) / WIDTH_IN,
            (height_in - bottom - top) / height_in,
        )
    )
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#999999")
    axes.tick_params(labelsize=8, color="#999999", labelcolor=INK, length=3)
    axes.xaxis.label.set(fontsize=8.5, color=INK)
    axes.yaxis.label.set(fontsize=8.5, color=INK)
    return figure, axes


def title(axes: Axes, text: str, *, colour: str = INK, note: str = "") -> None:
    """Write a title on the left, and a note on the right."""
    axes.set_title(text, loc="left", fontsize=8.5, fontweight="bold", color=colour)
    axes.set_title(note, loc="right", fontsize=8, color=SOFT)


def legend_below(figure: Figure, names: Sequence[str], colours: Colours) -> None:
    """Write a legend of lines in the lower margin, one or two to a row."""
    handles = [Line2D([], [], color=colours[name], linewidth=2.2, label=name) for name in names]
    figure.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.02, 0.0),
        ncols=1 if max(map(len, names)) > 20 else 2,
        fontsize=8,
        frameon=False,
        handlelength=1.4,
        columnspacing=1.2,
        labelspacing=0.3,
        borderpad=0.1,
    )


def legend_height_in(names: Sequence[str]) -> float:
    """Return how much room ``legend_below`` takes."""
    rows = len(names) if max(map(len, names)) > 20 else (len(names) + 1) // 2
    return 0.1 + 0.17 * rows


def as_png(figure: Figure, made_by: str) -> tuple[bytes, int, int]:
    """Return a PNG that names the command it was made by, its width and height in CSS pixels.

    There is neither date nor version in it: the same figure is the same file.
    """
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    image = Image.fromarray(pixels).convert("RGB")
    image = image.quantize(_PALETTE, dither=Image.Dither.NONE)
    about = PngInfo()
    about.add_text("Comment", f"Made by: {made_by}")
    small = io.BytesIO()
    image.save(small, format="png", optimize=True, pnginfo=about)
    width, height = figure.get_size_inches() * _INCH_PX
    return small.getvalue(), round(width), round(height)
