"""What may be claimed about a suite, in words; no claim without an interval behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from defmanip_gym.evaluation.analysis import Duel, SuiteAnalysis
from defmanip_gym.evaluation.broken_certificates import broken_certificates
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics.intervals import Estimate
from defmanip_gym.evaluation.statistics.paired import Difference
from defmanip_gym.evaluation.statistics.summary import Summary
from defmanip_gym.evaluation.statistics.verdicts import LearnedAgainstAnalytic, Standing

_MOST_NAMES = 6


@dataclass(frozen=True)
class Claim:
    """A sentence with an interval behind it, and what else there is to say."""

    text: str
    detail: str = ""


def suite_claims(analysis: SuiteAnalysis) -> tuple[Claim, ...]:
    """Return the suite's paragraph: who is best, and learned against analytic."""
    summaries = {summary.contestant: summary for summary in analysis.summaries}
    claims = [Claim(standing_sentence("Among all contestants", analysis.overall, summaries))]
    if analysis.certified is not None:
        who = "Among those inside a safety filter"
        claims.append(Claim(standing_sentence(who, analysis.certified, summaries)))
    duels = {
        "Without a filter": analysis.free_duel,
        "Inside a filter": analysis.certified_duel,
    }
    for who, duel in duels.items():
        if duel is not None:
            detail = "" if duel.result.nobody_arrived else contrast_sentence(duel)
            claims.append(Claim(duel_sentence(who, duel.result), detail))
    return tuple(claims)


def certificate_claim(records: Sequence[EpisodeRecord]) -> Claim | None:
    """Return whether filters kept their word where they apply; None if they apply nowhere."""
    covered = sum(record.certificate_applies is True for record in records)
    if not covered:
        return None
    broken = broken_certificates(records)
    if not broken:
        return Claim(f"Filters held: σ was kept in all {covered} episodes that one covers.")
    names = ", ".join(sorted({record.contestant for record in broken}))
    return Claim(
        f"FILTERS BROKEN: σ was exceeded in {len(broken)} of {covered} episodes that one "
        f"covers ({names})."
    )


def standing_sentence(who: str, standing: Standing, summaries: Mapping[str, Summary]) -> str:
    """Return who is best of a class, or that nobody can be called so.

    Args:
        who: the class, as the beginning of a sentence.
        standing: of the class.
        summaries: of its members.
    """
    first = standing.order[0]
    if standing.nobody_arrived:
        return f"{who}, nobody reached the goal within σ."
    if not standing.differences:
        return f"{who}, only {first} took part."
    unknown = [d.second for d in standing.differences if d.iqm.interval is None]
    if unknown:
        return (
            f"{who}, nobody can be called best: {first} scores highest ({_iqm(summaries[first])}), "
            "but with one agent each, and one scenario for each condition, there is no interval "
            f"for its difference from {_listed(unknown)}."
        )
    if standing.winner is None:
        listed = _listed([f"{name} ({_iqm(summaries[name])})" for name in standing.leaders])
        return f"{who}, nobody is best: the intervals do not separate {listed}."
    summary, nearest = summaries[first], standing.differences[0]
    return (
        f"{who}, {first} is best: its score of {_iqm(summary)} exceeds that of each of the other "
        f"{len(standing.differences)}, next {nearest.second} by {_by(nearest)}. It succeeds in "
        f"{_percent(summary.success.share)} and exceeds σ in {_percent(summary.violation.share)} "
        "of its episodes."
    )


def duel_sentence(who: str, result: LearnedAgainstAnalytic) -> str:
    """Return whether learned contestants beat analytic ones; it never leaves the question out."""
    learned, analytic, gap = result.learned, result.analytic, result.difference
    if result.nobody_arrived:
        return f"{who}, neither learned nor analytic contestants reached the goal within σ."
    if result.verdict == "learned":
        return (
            f"{who}, learning beats the analytic controllers: {learned} scores higher than every "
            f"one of them, than the best, {analytic}, by {_by(gap)}."
        )
    if result.verdict == "analytic":
        return (
            f"{who}, no learned contestant beats the best analytic one: {analytic} scores higher "
            f"than every one of them; the best, {learned}, differs by {_by(gap)}."
        )
    if gap.iqm.interval is None:
        return (
            f"{who}, nothing is claimed: {learned} differs from {analytic} by "
            f"{_signed(gap.iqm.value, 3)}, and with one agent each, and one scenario for each "
            "condition, there is no interval."
        )
    if gap.first_is_better or gap.second_is_better:
        return (
            f"{who}, no learned contestant beats all analytic ones, nor the reverse, where "
            f"intervals allow to say so: {learned} differs from {analytic} by {_by(gap)}, but the "
            "other contestants' intervals are too wide."
        )
    return (
        f"{who}, no learned contestant beats the best analytic one as far as intervals show, nor "
        f"the reverse: {learned} differs from {analytic} by {_by(gap)}."
    )


def answer(analyses: Sequence[SuiteAnalysis]) -> str:
    """Return what learning adds on which suites, in a sentence or two."""
    verdicts = {
        analysis.suite: {
            duel.result.verdict
            for duel in (analysis.free_duel, analysis.certified_duel)
            if duel is not None
        }
        for analysis in analyses
    }
    better = [suite for suite, found in verdicts.items() if "learned" in found]
    worse = [suite for suite, found in verdicts.items() if found == {"analytic"}]
    open_ = [suite for suite in verdicts if suite not in (*better, *worse)]
    parts = []
    if better:
        parts.append(
            f"Learning adds something on {_listed(better)}, where an agent, alone or inside a "
            "filter, scores higher than every analytic controller of its class."
        )
    else:
        parts.append(
            "Learning adds nothing that intervals show: on no suite does an agent score higher "
            "than every analytic controller."
        )
    if worse:
        parts.append(
            f"On {_listed(worse)} the best analytic controller scores higher than every agent, "
            "alone and inside a filter."
        )
    if open_:
        parts.append(f"On {_listed(open_)} intervals do not separate them throughout.")
    return " ".join(parts)


def contrast_sentence(duel: Duel) -> str:
    """Return what the two best differ by besides the score."""
    result, contrast = duel.result, duel.contrast
    parts = [f"success {_number(contrast.success, 0, 100, signed=True)} percentage points"]
    if contrast.time_s is not None:
        time_s = _number(contrast.time_s, 1, signed=True)
        parts.append(f"time to the goal {time_s} s where both arrive")
    improvement = _number(contrast.improvement, 2)
    return (
        f"{result.learned} minus {result.analytic}: {', '.join(parts)}; on the same scenario it "
        f"scores higher with probability {improvement}."
    )


def headline(standing: Standing) -> str:
    """Return a few words for a table of contents."""
    if standing.nobody_arrived:
        return "nobody reached the goal within σ"
    if standing.winner is not None:
        return f"best: {standing.winner}"
    if any(difference.iqm.interval is None for difference in standing.differences):
        return f"highest, without intervals: {standing.order[0]}"
    return f"not separated: {_listed(standing.leaders)}"


def _by(difference: Difference) -> str:
    """Return a difference of scores with its interval; of the mean too where that tells more."""
    iqm, mean = difference.iqm, difference.mean
    text = f"{_signed(iqm.value, 3)} ({_confidently(difference, iqm)})"
    if difference.first_is_better or difference.second_is_better:
        return text
    both = f"{_signed(mean.value, 3)} ({_confidently(difference, mean)})"
    return f"{text} in the IQM and {both} in the mean"


def _confidently(difference: Difference, estimate: Estimate) -> str:
    low, high = (_signed(end, 3) for end in estimate.interval or ())
    return f"{100 * difference.confidence:.4g} % interval {low} to {high}"


def _number(estimate: Estimate, digits: int, scale: float = 1.0, *, signed: bool = False) -> str:
    def text(value: float) -> str:
        scaled = scale * value
        return _signed(scaled, digits) if signed else f"{scaled:.{digits}f}"

    if estimate.interval is None or estimate.interval[0] == estimate.interval[1]:
        return text(estimate.value)
    low, high = estimate.interval
    return f"{text(estimate.value)} [{text(low)}, {text(high)}]"


def _signed(value: float, digits: int) -> str:
    text = f"{value:+.{digits}f}"
    return text.replace("-", "−") if float(text) else text[1:]


def _iqm(summary: Summary) -> str:
    return f"{summary.score['iqm'].value:.3f}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _listed(names: Sequence[str]) -> str:
    if len(names) > _MOST_NAMES:
        names = [*names[:_MOST_NAMES], f"{len(names) - _MOST_NAMES} more"]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
