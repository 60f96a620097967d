"""Shares of the optimum."""

from __future__ import annotations

import numpy as np
import pytest
from episodes import record
from test_summary import summary_of_records

from defmanip_gym.evaluation.optimum import optimum_s, optimum_share
from defmanip_gym.evaluation.suites import suite_named

START = suite_named("nominal").scenarios[0].start


def test_an_episode_at_the_optimum_has_the_share_one():
    best = optimum_s(START)
    assert optimum_share(record(start=START, time_to_goal_s=best)) == pytest.approx(1.0)
    assert optimum_share(record(start=START, time_to_goal_s=2 * best)) == pytest.approx(0.5)


def test_episodes_without_success_have_none_of_it():
    failed = record(start=START, outcome="violation", success=False, violated=True)
    assert optimum_share(failed) == 0.0


def test_starts_of_no_suite_have_no_share():
    assert optimum_share(record(start=(1.0, 2.0, 0.0, 1.0, -1.5, 0.0))) is None


def test_summaries_have_the_share_where_starts_are_known():
    best = optimum_s(START)
    known = [{"start": START, "time_to_goal_s": share * best} for share in (1.25, 2.0)]
    assert summary_of_records(*known).optimum_share.value == pytest.approx(np.mean((0.8, 0.5)))
    assert summary_of_records({}, {}).optimum_share is None
