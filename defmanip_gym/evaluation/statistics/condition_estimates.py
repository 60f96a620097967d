"""Estimates under each condition of a suite on its own."""

from __future__ import annotations

from dataclasses import replace

from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable
from defmanip_gym.evaluation.statistics.intervals import Estimate
from defmanip_gym.evaluation.statistics.resampling import CrossedBootstrap
from defmanip_gym.evaluation.statistics.scores import score
from defmanip_gym.evaluation.statistics.summary import success_rate


def score_under_conditions(table: EpisodeTable) -> dict[str, Estimate]:
    """Return the interquartile mean of the score under each condition."""
    return {
        condition: score(CrossedBootstrap(own.conditions), own).estimate("iqm")
        for condition, own in _by_condition(table).items()
    }


def success_under_conditions(table: EpisodeTable) -> dict[str, Estimate]:
    """Return the success rate under each condition."""
    estimates = {}
    for condition, own in _by_condition(table).items():
        rate = success_rate(CrossedBootstrap(own.conditions), own)
        estimates[condition] = Estimate(value=rate.share, interval=rate.interval)
    return estimates


def _by_condition(table: EpisodeTable) -> dict[str, EpisodeTable]:
    """Return the table's columns of each condition."""
    parts = {}
    for condition in dict.fromkeys(table.conditions):
        columns = [i for i, name in enumerate(table.conditions) if name == condition]
        parts[condition] = replace(
            table,
            scenarios=tuple(table.scenarios[i] for i in columns),
            conditions=(condition,) * len(columns),
            rows=tuple(tuple(row[i] for i in columns) for row in table.rows),
        )
    return parts
