"""The columns of the table of filters, whatever it is written as."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.evaluation.filter_timings import FilterTimes
from defmanip_gym.evaluation.report.columns import NONE, Cell, Column, rate_cell
from defmanip_gym.evaluation.statistics.filter_effects import FilterEffect


@dataclass(frozen=True, kw_only=True)
class FilterRow:
    """A filter in a suite's table.

    Attributes:
        effect: what it changed.
        times: how long it takes to decide; None if not measured.
        viable_share: what of the nominal beam's viable set it keeps to; None if not known.
    """

    effect: FilterEffect
    times: FilterTimes | None
    viable_share: float | None


def _size(value: float | None) -> str:
    if value is None:
        return NONE
    return f"{value:.2f}" if value >= 0.01 or value == 0 else "< 0.01"


def _share(share: float) -> str:
    return f"{100 * share:.1f}" if share >= 0.0005 or share == 0 else "< 0.1"


def _microseconds(seconds: float | None) -> str:
    if seconds is None:
        return NONE
    return f"{1e6 * seconds:.1f}" if seconds < 1e-4 else f"{1e6 * seconds:.0f}"


FILTER_COLUMNS: tuple[Column[FilterRow], ...] = (
    Column(
        heading="Controllers",
        unit="episodes",
        legend="how many ran both alone and inside the filter, and the pairs of episodes on which "
        "all of this row is; analytic ones know the certificate that they are in",
        cell=lambda row: Cell(
            str(len(row.effect.controllers)), str(row.effect.violation_alone.trials)
        ),
    ),
    Column(
        heading="Violations",
        unit="% alone",
        legend="share of these episodes in which the swing exceeded σ, without the filter",
        cell=lambda row: rate_cell(row.effect.violation_alone),
    ),
    Column(
        heading="Violations",
        unit="% inside",
        legend="the same with it",
        cell=lambda row: rate_cell(row.effect.violation_inside),
    ),
    Column(
        heading="Success",
        unit="% alone",
        legend="share that reached the goal without ever exceeding σ, without the filter",
        cell=lambda row: rate_cell(row.effect.success_alone),
    ),
    Column(
        heading="Success",
        unit="% inside",
        legend="the same with it",
        cell=lambda row: rate_cell(row.effect.success_inside),
    ),
    Column(
        heading="Changed",
        unit="% of commands",
        legend="share of the commands that the filter changed",
        cell=lambda row: Cell(_share(row.effect.changed)),
    ),
    Column(
        heading="Correction",
        unit="mean, m/s²",
        legend="mean change of the commands that it changed",
        cell=lambda row: Cell(_size(row.effect.mean_correction_m_s2)),
    ),
    Column(
        heading="Correction",
        unit="largest, m/s²",
        legend="largest change of any command",
        cell=lambda row: Cell(_size(row.effect.largest_correction_m_s2)),
    ),
    Column(
        heading="Chattering",
        unit="1/s",
        legend="how often a second its change of the forward command had another sign than its "
        "last one",
        cell=lambda row: Cell(_size(row.effect.reversals_per_s)),
    ),
    Column(
        heading="Viable",
        unit="% of the set",
        legend="share of the states from which forward acceleration can keep the nominal beam "
        "within σ at all that the filter lets it come to; – where that is not known",
        cell=lambda row: Cell(NONE if row.viable_share is None else _share(row.viable_share)),
    ),
    Column(
        heading="Decision",
        unit="median, µs",
        legend="wall time in which the filter alone decides for one episode and takes note of what "
        "came of it, while the swing is fed against it, on the machine that made this report",
        cell=lambda row: Cell(_microseconds(row.times.median_s if row.times else None)),
    ),
    Column(
        heading="Decision",
        unit="p99, µs",
        legend="the time that one decision in a hundred exceeds; with other work on the machine it "
        "tells of that",
        cell=lambda row: Cell(_microseconds(row.times.p99_s if row.times else None)),
    ),
)
