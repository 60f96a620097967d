"""Shaped commands leave no swing behind, and little where the frequency is a little wrong."""

import numpy as np
import pytest

from defmanip_gym.errors import GainError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.input_shaping import shaper, slowest_swing
from defmanip_gym.theory.control.sampled_lqr import sampled
from defmanip_gym.theory.payload.zero_dynamics import linearize

PERIOD = 0.02


def residual_swing(weights, beam):
    """Return the amplitude that a second of 1 m/s² leaves once it is shaped, rad."""
    linear = linearize(beam)
    A, B = sampled(linear.A_u, linear.forward_input, PERIOD)
    command, state = np.convolve(np.ones(50), weights), np.zeros(2)
    for w in command:
        state = A @ state + B * w
    return np.hypot(state[0], state[1] / slowest_swing(linear)[0])


def shaped(kind, beam=BeamParams()):  # noqa: B008
    return shaper(*slowest_swing(linearize(beam)), PERIOD, kind)


def test_the_swing_of_a_rod_is_what_its_formula_says():
    frequency, damping_ratio = slowest_swing(linearize(BeamParams()))
    assert frequency == pytest.approx(np.sqrt(1.5 * 9.81 / 0.6))
    assert damping_ratio == pytest.approx(0.1 / (2 * 3.1153 * 0.6**2 / 3 * frequency), rel=1e-3)


@pytest.mark.parametrize("kind", ["zv", "zvd", "zvdd"])
def test_nothing_is_added_and_no_swing_is_left(kind):
    weights = shaped(kind)
    assert weights.sum() == pytest.approx(1.0) and (weights >= 0).all()
    unshaped = residual_swing(np.ones(1), BeamParams())
    assert residual_swing(weights, BeamParams()) < 0.02 * unshaped


def test_each_derivative_more_forgives_more():
    longer = BeamParams(length_m=0.75)
    left = [residual_swing(shaped(kind), longer) for kind in ("zv", "zvd", "zvdd")]
    assert left[0] > 2 * left[1] > 4 * left[2]


def test_each_takes_half_a_period_more():
    half_period = np.pi / slowest_swing(linearize(BeamParams()))[0] / PERIOD
    lengths = [len(shaped(kind)) for kind in ("zv", "zvd", "zvdd")]
    np.testing.assert_allclose(np.diff(lengths), half_period, atol=1.0)


def test_what_does_not_oscillate_needs_none():
    with pytest.raises(GainError, match="oscillates"):
        slowest_swing(linearize(BeamParams(damping=50.0)))
