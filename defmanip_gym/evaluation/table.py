"""The summaries as text: for the terminal, the report and as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.table import Table

from defmanip_gym.evaluation.statistics import Estimate, Interval, Rate, Summary
from defmanip_gym.files import write_atomically

_NONE = "–"


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column for readers.

    Attributes:
        heading: without unit.
        unit: may be empty.
        value: the number as text.
        interval: its interval as text, empty where there is none.
        legend: what exactly the number is.
    """

    heading: str
    unit: str
    value: Callable[[Summary], str]
    interval: Callable[[Summary], str]
    legend: str

    @property
    def title(self) -> str:
        """Heading with unit."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading


def _number(value: float | None, digits: int) -> str:
    return _NONE if value is None else f"{value:.{digits}f}"


def _percent(share: float | None) -> str:
    return _NONE if share is None else f"{100 * share:.0f}"


def _percent_interval(rate: Rate) -> str:
    low, high = rate.interval
    return f"{_percent(low)}–{_percent(high)}"


def _iqm(estimate: Estimate | None, digits: int) -> str:
    return _NONE if estimate is None else _number(estimate.value, digits)


def _iqm_interval(estimate: Estimate | None, digits: int) -> str:
    if estimate is None or estimate.interval is None:
        return ""
    low, high = estimate.interval
    return f"{low:.{digits}f}–{high:.{digits}f}"


def _no_interval(summary: Summary) -> str:
    return ""


COLUMNS = (
    Column(
        heading="Success",
        unit="%",
        value=lambda s: _percent(s.success.share),
        interval=lambda s: _percent_interval(s.success),
        legend="share of episodes that reached the goal without ever exceeding σ; 95 % Wilson "
        "interval",
    ),
    Column(
        heading="Violations",
        unit="%",
        value=lambda s: _percent(s.violation.share),
        interval=lambda s: _percent_interval(s.violation),
        legend="share of episodes in which the swing exceeded σ at any time; 95 % Wilson interval",
    ),
    Column(
        heading="Left / late",
        unit="",
        value=lambda s: f"{s.outcomes['left_workspace']} / {s.outcomes['timeout']}",
        interval=_no_interval,
        legend="episodes without violation that ended by leaving the workspace (arm stretched or "
        "folded, or too far from the goal), and by reaching the horizon",
    ),
    Column(
        heading="max |φ|/σ",
        unit="",
        value=lambda s: _number(s.largest_swing_share, 2),
        interval=_no_interval,
        legend="largest swing in any episode, over σ",
    ),
    Column(
        heading="Time, median",
        unit="s",
        value=lambda s: _number(s.time_to_goal_median_s, 1),
        interval=_no_interval,
        legend="median time to the goal over successful episodes",
    ),
    Column(
        heading="Time, IQM",
        unit="s",
        value=lambda s: _iqm(s.time_to_goal_iqm_s, 1),
        interval=lambda s: _iqm_interval(s.time_to_goal_iqm_s, 1),
        legend="interquartile mean of the time to the goal over successful episodes; 95 % "
        "bootstrap interval",
    ),
    Column(
        heading="Distance left",
        unit="m",
        value=lambda s: _number(s.final_distance_m, 2),
        interval=lambda s: f"of {_number(s.start_distance_m, 2)}",
        legend="median distance of the grasp to the goal at the end, and at the start",
    ),
    Column(
        heading="Peak force",
        unit="N",
        value=lambda s: _number(s.peak_grasp_force_n, 1),
        interval=_no_interval,
        legend="largest force on the grasp in any episode; holding the object's weight is "
        "part of it",
    ),
    Column(
        heading="Energy, IQM",
        unit="J",
        value=lambda s: _iqm(s.energy_j, 1),
        interval=lambda s: _iqm_interval(s.energy_j, 1),
        legend="interquartile mean of ∫|F·v| dt at the grasp over all episodes; 95 % bootstrap "
        "interval",
    ),
    Column(
        heading="Interventions",
        unit="% of steps",
        value=lambda s: _percent(s.interventions),
        interval=lambda s: (
            "" if s.mean_intervention_m_s2 is None else f"{s.mean_intervention_m_s2:.2g} m/s²"
        ),
        legend="share of steps in which the ν_max wrapper changed the command, and the mean change "
        "over all steps; – without wrapper",
    ),
)


def terminal_table(summaries: Sequence[Summary]) -> Table:
    """Return the summaries as a rich table, intervals under the values."""
    table = Table(
        box=box.SIMPLE_HEAD,
        collapse_padding=True,
        caption="95 % intervals below the values; time over successful episodes only",
    )
    table.add_column("Contestant", no_wrap=True, style="bold")
    for column in COLUMNS:
        table.add_column(_on_two_lines(column.title), justify="right", no_wrap=True)
    for summary in summaries:
        cells = (f"{c.value(summary)}\n[dim]{c.interval(summary)}[/]" for c in COLUMNS)
        table.add_row(summary.contestant, *cells)
    return table


def _on_two_lines(title: str) -> str:
    return title.replace(" ", "\n", 1)


def write_csv(path: Path, summaries: Sequence[Summary]) -> None:
    """Write the summaries with full precision; units stand in the names."""
    buffer = io.StringIO()
    rows = [_csv_row(summary) for summary in summaries]
    writer = csv.DictWriter(buffer, fieldnames=list(rows[0]) if rows else ["contestant"])
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, buffer.getvalue().encode("utf-8"))


def _csv_row(summary: Summary) -> dict[str, str | float | int | None]:
    def bounds(name: str, interval: Interval | None) -> dict[str, float | None]:
        low, high = interval or (None, None)
        return {f"{name}_low": low, f"{name}_high": high}

    time, energy = summary.time_to_goal_iqm_s, summary.energy_j
    return {
        "contestant": summary.contestant,
        "episodes": summary.success.trials,
        "success_rate": summary.success.share,
        **bounds("success_rate", summary.success.interval),
        "violation_rate": summary.violation.share,
        **bounds("violation_rate", summary.violation.interval),
        **{f"outcome_{outcome}": count for outcome, count in summary.outcomes.items()},
        "largest_swing_share": summary.largest_swing_share,
        "time_to_goal_median_s": summary.time_to_goal_median_s,
        "time_to_goal_iqm_s": time.value if time else None,
        **bounds("time_to_goal_iqm_s", time.interval if time else None),
        "start_distance_median_m": summary.start_distance_m,
        "final_distance_median_m": summary.final_distance_m,
        "peak_grasp_force_n": summary.peak_grasp_force_n,
        "energy_iqm_j": energy.value,
        **bounds("energy_iqm_j", energy.interval),
        "intervention_rate": summary.interventions,
        "mean_intervention_m_s2": summary.mean_intervention_m_s2,
    }
