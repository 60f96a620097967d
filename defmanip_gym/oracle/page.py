"""The page of optima: T* of every start, and what following the plans takes on the plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defmanip_gym.baselines.analytic.time_optimal import TimeOptimalController
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.options import FILTER_OPTION
from defmanip_gym.evaluation.protection import StorageProtection
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import Suite
from defmanip_gym.planning.stored import StoredPlans

_CONTESTANT = f"time_optimal/{FILTER_OPTION}"


def driven(plans: StoredPlans, suite: Suite) -> tuple[EpisodeRecord, ...]:
    """Return the records of following the plans through a suite, inside the storage filter."""
    records: list[EpisodeRecord] = []
    controller = TimeOptimalController(plans=plans)
    protection = StorageProtection(FILTER_OPTION, inner_loop=controller.inner_loop)
    for condition in suite.conditions:
        episodes = rollout(
            Entry(suite=suite.name, contestant=_CONTESTANT, family="analytic"),
            controller,
            suite.of(condition),
            config=condition.environment_on(controller.inner_loop),
            horizon_s=suite.horizon_s,
            safety_filter=protection.filter_for(condition),
            delay_periods=condition.delay_periods,
        )
        records += [episode.record for episode in episodes]
    return tuple(records)


def optimum_page(plans: StoredPlans, suites: Sequence[Suite]) -> str:
    """Return the page in Markdown."""
    records = {suite.name: driven(plans, suite) for suite in suites}
    lines = [*_HEAD]
    for suite in suites:
        for condition in suite.conditions:
            own = [r for r in records[suite.name] if r.condition == condition.name]
            lines.append(_condition_line(plans, suite.name, own))
    lines += _SCENARIO_HEAD
    lines += [_scenario_line(plans, record) for suite in suites for record in records[suite.name]]
    return "\n".join([*lines, ""])


def ratio(plans: StoredPlans, record: EpisodeRecord) -> float:
    """Return T/T* of an episode, infinite without success."""
    known = plans.find(record.start)
    if known is None or not record.success or record.time_to_goal_s is None:
        return float("inf")
    return record.time_to_goal_s / known.optimum_s


def _condition_line(plans: StoredPlans, suite: str, records: Sequence[EpisodeRecord]) -> str:
    ratios = np.array([ratio(plans, record) for record in records])
    optima = [plan.optimum_s for r in records if (plan := plans.find(r.start)) is not None]
    cells = (
        suite,
        f"`{records[0].condition}`",
        str(len(records)),
        f"{np.median(optima):.2f} ({min(optima):.2f}–{max(optima):.2f})",
        str(sum(record.success for record in records)),
        str(sum(record.violated for record in records)),
        _number(float(np.median(ratios))),
        _number(float(ratios.max())),
        f"{max(record.largest_swing_share for record in records):.2f}",
    )
    return "| " + " | ".join(cells) + " |"


def _scenario_line(plans: StoredPlans, record: EpisodeRecord) -> str:
    known = plans.find(record.start)
    best = "–" if known is None else f"{known.optimum_s:.3f}"
    share = _number(ratio(plans, record))
    return f"| {record.suite} | `{record.scenario}` | {best} | {share} | {record.outcome} |"


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "–"


_HEAD = (
    "# The optimum, and driving it",
    "",
    "Made by `defmanip plan --output FILE --page docs/optimum.md`. T* is the time-optimal time",
    "from a start ([derivations.md](derivations.md), section 24), without margins, of the nominal",
    "model, whatever the condition. T is what `time_optimal` takes inside the storage filter on",
    "the plant of the condition, following plans with margins. A dash is no success.",
    "",
    "| suite | condition | starts | T* in s, median (range) | success | violations | T/T* median "
    "| largest | swing max/σ |",
    "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
)
_SCENARIO_HEAD = (
    "",
    "## By scenario",
    "",
    "| suite | scenario | T* (s) | T/T* | outcome |",
    "| --- | --- | ---: | ---: | --- |",
)
