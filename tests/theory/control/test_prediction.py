"""Predictions are what the linear model does, and headings change as they say."""

import numpy as np
import pytest

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.prediction import Prediction, validated_blocks
from defmanip_gym.theory.control.sampled_lqr import forward_motion, sampled
from defmanip_gym.theory.payload.zero_dynamics import linearize

PERIOD, BLOCKS, REACH = 0.02, (1, 2, 3, 5), 0.7
LINEAR = linearize(BeamParams(segment_count=2))
PREDICTION = Prediction(LINEAR, BLOCKS, PERIOD)
RNG = np.random.default_rng(0)


def test_blocks_do_what_their_periods_do_one_by_one():
    w, state = RNG.normal(size=len(BLOCKS)), np.concatenate(((0.0, 0.0), RNG.normal(size=4)))
    A, B = sampled(*forward_motion(LINEAR), PERIOD)
    predicted = PREDICTION.swing @ w + PREDICTION.free_swing @ state[2:]
    for block, periods in enumerate(BLOCKS):
        for _ in range(periods):
            state = A @ state + B * w[block]
        np.testing.assert_allclose(PREDICTION.position[block] @ w, state[0], atol=1e-12)
        np.testing.assert_allclose(PREDICTION.velocity[block] @ w, state[1], atol=1e-12)
        np.testing.assert_allclose(predicted[block], state[2:], atol=1e-12)


def test_small_changes_of_a_plan_turn_the_base_as_they_say():
    reach, heading = np.array([REACH]), np.array([0.3])
    plan, velocity = RNG.normal(size=(1, len(BLOCKS), 2)), np.array([[1.5, 0.4]])
    change = 1e-4 * RNG.normal(size=plan.shape)
    before = PREDICTION.courses(heading, velocity, plan, reach)
    after = PREDICTION.courses(heading, velocity, plan + change, reach)
    faster = after.mean_velocity - before.mean_velocity
    left = faster[..., 1] * np.cos(before.middle) - faster[..., 0] * np.sin(before.middle)
    expected = np.einsum("nkb,nb->nk", before.per_left_speed, left)
    np.testing.assert_allclose(after.end - before.end, expected, rtol=0.1, atol=1e-7)


def test_blocks_are_whole_periods():
    assert validated_blocks("blocks", [1, 2]) == (1, 2)
    with pytest.raises(ParameterError, match="blocks"):
        validated_blocks("blocks", (1, 0))


def test_a_horizon_has_some_blocks_but_not_any_number_and_numpy_counts():
    assert validated_blocks("blocks", [np.int64(1), 2]) == (1, 2)
    for wrong in ((), (1,) * 1000, (True, 2), (1.0, 2), 5):
        with pytest.raises(ParameterError, match="blocks"):
            validated_blocks("blocks", wrong)
