"""Cards as text for the terminal."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields

from rich import box
from rich.markup import escape
from rich.table import Table

from defmanip_gym.baselines.learned.card import AgentCard, SuiteScore
from defmanip_gym.evaluation.statistics import wilson_interval

_NONE = "–"
_LISTED_SUITE = "nominal"
_SHOWN_ELSEWHERE = ("normalization", "hyperparameters", "scores", "command")


def agents_table(cards: Mapping[str, AgentCard]) -> Table:
    """Return one row per agent, whose name begins with its recipe's."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("agent", no_wrap=True)
    table.add_column("steps", justify="right", no_wrap=True)
    table.add_column("trained\ninside")
    table.add_column(f"success (%)\n{_LISTED_SUITE}", justify="right")
    table.add_column(f"score\n{_LISTED_SUITE}", justify="right")
    for name, card in cards.items():
        score = card.scores.get(_LISTED_SUITE)
        table.add_row(
            escape(name),
            f"{card.total_timesteps / 1e6:.2f} M",
            card.trained_inside or _NONE,
            _NONE if score is None else _success(score),
            _NONE if score is None else f"{score.score_iqm:.3f}",
        )
    return table


def card_table(name: str, card: AgentCard) -> Table:
    """Return every field of a card but its scores and commands."""
    table = Table(box=box.SIMPLE, show_header=False, title=escape(name), title_justify="left")
    table.add_column(no_wrap=True)
    table.add_column()
    for field in fields(card):
        value = getattr(card, field.name)
        if field.name not in _SHOWN_ELSEWHERE:
            table.add_row(field.name, _NONE if value is None else escape(str(value)))
    normalization = card.normalization
    table.add_row(
        "normalization",
        f"by the tensors' mean and variance (+ {normalization.variance_floor:g}), "
        f"clipped to ±{normalization.clip:g}",
    )
    table.add_row("hyperparameters", "")
    for key, value in card.hyperparameters.items():
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        table.add_row(escape(f"  {key}"), escape(text))
    return table


def scores_table(card: AgentCard) -> Table:
    """Return one row per suite."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("suite", no_wrap=True)
    headings = ("success (%)", "violations (%)", "score, IQM", "time, median (s)", "episodes")
    for heading in headings:
        table.add_column(heading, justify="right")
    for suite, score in card.scores.items():
        time = score.median_time_s
        table.add_row(
            escape(suite),
            _success(score),
            f"{100 * score.violation_rate:.0f}",
            f"{score.score_iqm:.3f}",
            _NONE if time is None else f"{time:.1f}",
            str(score.episodes),
        )
    return table


def _success(score: SuiteScore) -> str:
    low, high = wilson_interval(score.successes, score.episodes)
    return f"{100 * score.success_rate:.0f} ({100 * low:.0f}–{100 * high:.0f})"
