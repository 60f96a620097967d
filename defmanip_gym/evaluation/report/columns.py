"""The columns of the summary table, whatever it is written as."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from defmanip_gym.evaluation.statistics.intervals import Estimate, Rate
from defmanip_gym.evaluation.statistics.summary import Summary

NONE = "–"
RowT = TypeVar("RowT")


@dataclass(frozen=True, kw_only=True)
class Row:
    """A contestant in a suite's table.

    Attributes:
        summary: what was measured.
        privileged: what it knows beyond the observation.
        decision_time_s: median wall time of a decision; None if not measured.
    """

    summary: Summary
    privileged: str
    decision_time_s: float | None


@dataclass(frozen=True)
class Cell:
    """A number as text, with what stands under it in small print, often its interval."""

    value: str
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Column(Generic[RowT]):
    """A column for readers.

    Attributes:
        heading: without unit.
        unit: may be empty.
        legend: what exactly the number is.
        cell: makes it.
    """

    heading: str
    unit: str
    legend: str
    cell: Callable[[RowT], Cell]

    @property
    def title(self) -> str:
        """Heading with unit."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading


def estimate_cell(estimate: Estimate | None, digits: int) -> Cell:
    """Return a number with its interval."""
    if estimate is None:
        return Cell(NONE)
    value = _fixed(estimate.value, digits)
    if estimate.interval is None or estimate.interval[0] == estimate.interval[1]:
        return Cell(value)
    low, high = (_fixed(end, digits) for end in estimate.interval)
    return Cell(value, f"{low}–{high}")


def rate_cell(rate: Rate) -> Cell:
    """Return a rate in percent with its interval."""
    low, high = (f"{100 * end:.0f}" for end in rate.interval)
    return Cell(f"{100 * rate.share:.0f}", f"{low}–{high}")


def share_cell(share: float | None, note: str = "") -> Cell:
    """Return a share in percent."""
    return Cell(NONE) if share is None else Cell(f"{100 * share:.0f}", note)


def _fixed(value: float, digits: int) -> str:
    return f"{value:.{digits}f}"


def _interventions(row: Row) -> Cell:
    mean = row.summary.mean_intervention_m_s2
    size = "" if mean is None else f"{mean:.2f} m/s²" if mean >= 0.01 else "< 0.01 m/s²"
    return share_cell(row.summary.interventions, size)


def _other_ends(row: Row) -> Cell:
    outcomes = row.summary.outcomes
    ends = ("left_workspace", "timeout", "simulation_failed")
    return Cell(" / ".join(str(outcomes[end]) for end in ends))  # type: ignore[index]


def _decision(row: Row) -> Cell:
    return Cell(NONE if row.decision_time_s is None else f"{1e3 * row.decision_time_s:.2g}")


COLUMNS: tuple[Column[Row], ...] = (
    Column(
        heading="Score",
        unit="IQM",
        legend="mean speed towards the goal as a share of the speed limit, 0 for an episode that "
        "does not succeed; interquartile mean over episodes and its interval",
        cell=lambda row: estimate_cell(row.summary.score["iqm"], 3),
    ),
    Column(
        heading="T*/T",
        unit="IQM",
        legend="the time-optimal time from the very start over the time taken, 0 for an episode "
        "that does not succeed; T* is the nominal model's; interquartile mean over episodes",
        cell=lambda row: estimate_cell(row.summary.optimum_share, 3),
    ),
    Column(
        heading="Success",
        unit="%",
        legend="share of episodes that reached the goal without ever exceeding σ",
        cell=lambda row: rate_cell(row.summary.success),
    ),
    Column(
        heading="Violations",
        unit="%",
        legend="share of episodes in which the swing exceeded σ at any time",
        cell=lambda row: rate_cell(row.summary.violation),
    ),
    Column(
        heading="Swing",
        unit="max/σ",
        legend="largest swing in any episode, over σ",
        cell=lambda row: Cell(_fixed(row.summary.largest_swing_share, 2)),
    ),
    Column(
        heading="Swing",
        unit="CVaR/σ",
        legend="mean of the worst tenth of the episodes' largest swings, over σ",
        cell=lambda row: estimate_cell(row.summary.swing_share_cvar, 2),
    ),
    Column(
        heading="Time",
        unit="s",
        legend="time to the goal, interquartile mean over successful episodes",
        cell=lambda row: estimate_cell(row.summary.time_to_goal_s, 1),
    ),
    Column(
        heading="Path",
        unit="m",
        legend="length of the grasp's path, interquartile mean over successful episodes",
        cell=lambda row: estimate_cell(row.summary.path_length_m, 1),
    ),
    Column(
        heading="Energy",
        unit="J",
        legend="∫|F·v| dt at the grasp, interquartile mean over successful episodes",
        cell=lambda row: estimate_cell(row.summary.energy_j, 1),
    ),
    Column(
        heading="Force error",
        unit="N",
        legend="measured grasp force minus Eq. (10) of the nominal object, root mean square over "
        "an episode, interquartile mean over all episodes",
        cell=lambda row: estimate_cell(row.summary.force_error_n, 2),
    ),
    Column(
        heading="Interventions",
        unit="% of steps",
        legend="share of steps in which the filter changed the command, and the mean change "
        "over all steps; – without filter",
        cell=_interventions,
    ),
    Column(
        heading="Applies",
        unit="% of episodes",
        legend="share of episodes that the filter covers: their beam and start, and neither "
        "late actuators, sensor noise nor forces beyond the paper's; – without one",
        cell=lambda row: share_cell(row.summary.certificate_applies),
    ),
    Column(
        heading="Other ends",
        unit="left/late/failed",
        legend="episodes without violation that left the workspace, reached the horizon, or "
        "whose simulation failed",
        cell=_other_ends,
    ),
    Column(
        heading="Decision",
        unit="ms",
        legend="median wall time of one decision on one observation, filter included, on the "
        "machine that made this report",
        cell=_decision,
    ),
)
