"""Regulators stabilize grasp and swing of any object, in samples."""

import control
import numpy as np
import pytest

from defmanip_gym.errors import GainError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.sampled_lqr import (
    LqrWeights,
    forward_gains,
    forward_motion,
    quasi_static_swing,
    sampled,
    side_gains,
)
from defmanip_gym.theory.payload.zero_dynamics import linearize

PERIOD = 0.02


@pytest.mark.parametrize("segments", [1, 3, 8, 16])
def test_the_sampled_loop_is_stable(segments):
    linear = linearize(BeamParams(segment_count=segments))
    A, B = sampled(*forward_motion(linear), PERIOD)
    K = forward_gains(linear, LqrWeights(), PERIOD)
    assert np.abs(np.linalg.eigvals(A - np.outer(B, K))).max() < 1.0


def test_samples_agree_with_python_control():
    A, B = forward_motion(linearize(BeamParams(segment_count=2)))
    whole = control.c2d(control.ss(A, B[:, None], np.eye(6), 0), PERIOD)
    A_d, B_d = sampled(A, B, PERIOD)
    np.testing.assert_allclose(A_d, whole.A, atol=1e-12)
    np.testing.assert_allclose(B_d, whole.B[:, 0], atol=1e-12)


def test_at_a_constant_acceleration_the_swing_rests_where_it_says():
    linear = linearize(BeamParams(segment_count=3))
    rest = np.concatenate((quasi_static_swing(linear), np.zeros(3)))
    np.testing.assert_allclose(linear.A_u @ rest + linear.forward_input, 0.0, atol=1e-9)


def test_more_weight_on_the_position_makes_the_regulator_firmer():
    soft, firm = (side_gains(LqrWeights(position=q), PERIOD) for q in (1.0, 100.0))
    assert (firm > soft).all()


def test_wrong_weights_are_refused():
    with pytest.raises(ParameterError, match="position"):
        LqrWeights(position=0.0)


def test_where_no_regulator_exists_the_error_says_so(monkeypatch):
    def singular(*arguments):
        raise np.linalg.LinAlgError("singular")

    monkeypatch.setattr(control, "dlqr", singular)
    with pytest.raises(GainError, match="Riccati"):
        side_gains(LqrWeights(), PERIOD)
