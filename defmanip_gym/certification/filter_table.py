"""The filters that measure the swing, as text and numbers."""

from __future__ import annotations

from typing import Any

from rich import box
from rich.table import Table

from defmanip_gym.certification.filters import FilterLine
from defmanip_gym.certification.ladder import Ladder

_NONE = "–"


def filter_table(ladder: Ladder) -> Table:
    """Return the table for the terminal."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("filter", no_wrap=True)
    for heading in ("V_σ\nJ", "at σ\nthere", "level\n% of V_σ", "swing at rest\n% of σ"):
        table.add_column(heading, justify="right")
    table.add_column("proven for\nthe object")
    for line in ladder.filters:
        table.add_row(
            line.name,
            _NONE if line.pass_j is None else f"{line.pass_j:.4g}",
            line.coordinate or _NONE,
            _percent(line.level_share),
            _percent(_amplitude_share(line, ladder)),
            "no room left" if line.refusal else line.proof,
        )
    return table


def filter_remarks(ladder: Ladder) -> list[str]:
    """Return what has to be said beside the table."""
    told = [f"No {line.name} filter: {line.refusal}" for line in ladder.filters if line.refusal]
    if len(told) == len(ladder.filters):
        return told
    told.append(
        "Filters that measure the swing bound no acceleration: inside them any controller keeps "
        f"{'every coordinate' if ladder.beam is None else 'every segment'} within σ, damped or not."
    )
    told.append(
        "Of an object from a file V_σ is the lowest pass that a search found: the promise is one "
        "for that; in an environment payload_filter_for makes room for its errors."
        if ladder.beam is None
        else "The level leaves room for the default robot's errors; "
        "filter_for(env.unwrapped.config) makes it for another."
    )
    return told


def filter_numbers(ladder: Ladder) -> dict[str, Any]:
    """Return everything as JSON values, by the filters' names."""
    return {
        line.name: {
            "pass_j": line.pass_j,
            "at_sigma": line.coordinate or None,
            "level_share": line.level_share,
            "amplitude_share_of_sigma": _amplitude_share(line, ladder),
            "proof": line.proof,
            "refusal": line.refusal or None,
        }
        for line in ladder.filters
    }


def _amplitude_share(line: FilterLine, ladder: Ladder) -> float | None:
    return None if line.amplitude_rad is None else line.amplitude_rad / ladder.sigma


def _percent(share: float | None) -> str:
    return _NONE if share is None else f"{100 * share:.1f}"
