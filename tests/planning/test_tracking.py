"""Following a plan on the model it was made with."""

from __future__ import annotations

import numpy as np
import pytest

from defmanip_gym.planning.model import HEADING, REACH, advanced_rows
from defmanip_gym.planning.plan import Plan
from defmanip_gym.planning.plan_file import shipped_plans
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.planning.tracking import TrackingWeights, holding_gain, linearized, track_of

SETTING = PlanningSetting()
MODEL, PERIOD = SETTING.model, SETTING.task.control_period_s
DRIVE = shipped_plans().plans[0].drive


@pytest.fixture(scope="module")
def track():
    return track_of(MODEL, DRIVE, PERIOD, TrackingWeights())


def test_samples_are_the_planned_motion(track):
    moved = advanced_rows(
        MODEL, track.states[:-1], track.commands, np.full(len(track.commands), PERIOD)
    )
    np.testing.assert_allclose(moved[:-1], track.states[1:-1], atol=2e-3)
    assert len(track.commands) * PERIOD == pytest.approx(DRIVE.duration_s, abs=PERIOD)


def test_deviations_from_the_plan_die_out(track):
    state = track.states[0].copy()
    state[:3] += 0.05
    state[4] += 0.05
    alone = state.copy()
    for k, w in enumerate(track.commands):
        error = state - track.states[k]
        state = advanced_rows(MODEL, state, w - track.gains[k] @ error, PERIOD)
        alone = advanced_rows(MODEL, alone, w, PERIOD)
    assert np.abs(state[:3] - track.states[-1, :3]).max() < 0.01
    assert np.abs(alone[:3] - track.states[-1, :3]).max() > 0.05


def test_the_grasp_is_held_at_the_goal():
    gain = holding_gain(MODEL, PERIOD, TrackingWeights())
    state = np.zeros(11)
    state[REACH], state[:3], state[9] = MODEL.goal_reach_m, (0.04, -0.03, 0.02), 0.1
    for _ in range(200):
        state = advanced_rows(MODEL, state, -gain @ state, PERIOD)
    assert np.abs(state[[0, 1, 2, 4, 5, 6, 9, 10]]).max() < 5e-3


def test_linearizations_predict_small_deviations():
    states, w = DRIVE.states[:-1], DRIVE.commands
    A, B = linearized(MODEL, states, w, PERIOD)
    generator = np.random.default_rng(0)
    dx, dw = 1e-4 * generator.normal(size=states.shape), 1e-4 * generator.normal(size=w.shape)
    there = advanced_rows(MODEL, states + dx, w + dw, PERIOD)
    moved = there - advanced_rows(MODEL, states, w, PERIOD)
    expected = np.einsum("nij,nj->ni", A, dx) + np.einsum("nij,nj->ni", B, dw)
    np.testing.assert_allclose(moved, expected, atol=1e-6)


def test_a_resampled_plan_keeps_ends_and_duration():
    plan = DRIVE.resampled(50)
    assert isinstance(plan, Plan) and plan.commands.shape == (50, 3)
    assert plan.duration_s == DRIVE.duration_s
    np.testing.assert_allclose(plan.states[[0, -1]], DRIVE.states[[0, -1]])
    assert np.abs(np.diff(plan.states[:, HEADING])).max() < 0.5
