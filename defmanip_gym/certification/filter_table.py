"""The filters that know the state, as text and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich import box
from rich.table import Table

from defmanip_gym.certification.filters import FilterLine

_NONE = "–"


def filter_table(lines: Sequence[FilterLine]) -> Table:
    """Return the table for the terminal."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("filter", no_wrap=True)
    for heading in ("V_σ\nJ", "segment\nat σ there", "level\n% of V_σ", "swing at rest\n% of σ"):
        table.add_column(heading, justify="right")
    table.add_column("proven for\nthe object")
    for line in lines:
        segments = line.made.segment_count if line.made else None
        table.add_row(
            line.name,
            f"{line.pass_j:.4g}",
            str(line.segment + 1) + (f" of {segments}" if segments else ""),
            _percent(line.level_share),
            _percent(line.amplitude_share),
            "no room left" if line.made is None else line.made.proof,
        )
    return table


def filter_remarks(lines: Sequence[FilterLine]) -> list[str]:
    """Return what has to be said beside the table."""
    if not lines:
        return [
            "Filters that know the state: not yet for objects from files, whose stored energy is "
            "not modelled."
        ]
    made = [line for line in lines if line.made is not None]
    told = [f"No {line.name} filter: {line.refusal}" for line in lines if line.made is None]
    if made:
        told.append(
            "Filters that measure the swing bound no acceleration: inside them any controller "
            "keeps every segment within σ, damped or not. The level leaves room for the default "
            "robot's errors; filter_for(env.unwrapped.config) makes it for another."
        )
    return told


def filter_numbers(lines: Sequence[FilterLine]) -> dict[str, Any]:
    """Return everything as JSON values, by the filters' names."""
    return {
        line.name: {
            "pass_j": line.pass_j,
            "segment_at_sigma": line.segment,
            "level_share": line.level_share,
            "amplitude_share_of_sigma": line.amplitude_share,
            "proof": None if line.made is None else line.made.proof,
            "refusal": line.refusal or None,
        }
        for line in lines
    }


def _percent(share: float | None) -> str:
    return _NONE if share is None else f"{100 * share:.1f}"
