"""Which contestants a figure shows: the best of each kind, not all on top of each other."""

from __future__ import annotations

from collections.abc import Sequence

from defmanip_gym.evaluation.analysis import SuiteAnalysis
from defmanip_gym.evaluation.contestant import Contestant


def best_of_each_kind(
    analysis: SuiteAnalysis, contestants: Sequence[Contestant]
) -> tuple[str, ...]:
    """Return the best analytic and the best learned contestant, without and with a safety filter.

    Where a comparison has neither, everybody who is in the suite.
    """
    free = [c.name for c in contestants if c.protection is None]
    certified = [c.name for c in contestants if c.protection is not None]
    candidates = (
        analysis.best(family, names)
        for names in (free, certified)
        for family in ("analytic", "learned")
    )
    chosen = tuple(name for name in candidates if name is not None)
    return chosen or tuple(summary.contestant for summary in analysis.summaries)


def pairs_to_watch(
    analysis: SuiteAnalysis, contestants: Sequence[Contestant]
) -> dict[str, tuple[str, ...]]:
    """Return (analytic, learned) without and with a filter, by heading; one may be missing."""
    pairs = {}
    for heading, wanted in (("Without a filter", False), ("Inside a filter", True)):
        names = [c.name for c in contestants if (c.protection is not None) is wanted]
        best = (analysis.best(family, names) for family in ("analytic", "learned"))
        pair = tuple(name for name in best if name is not None)
        if pair:
            pairs[heading] = pair
    return pairs
