import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.theory.certificates.acceleration_budget import (
    acceleration_share,
    largest_field_speed,
    margin_scaling,
    semiglobal_gain,
)

PAPERS_NU_MAX = 1.089e-3


def test_share_is_what_speed_and_feedback_leave():
    assert acceleration_share(1.0, 0.3, 0.2) == pytest.approx(0.5)
    with pytest.raises(CertificateError, match="no room"):
        acceleration_share(1.0, 0.7, 0.31)


@given(st.floats(1e-4, 5), st.floats(1e-3, 5), st.integers(0, 10**6))
def test_low_gain_tracking_never_saturates(share, largest_error, seed):
    gain = semiglobal_gain(share, largest_error)
    error = np.random.default_rng(seed).uniform(-1, 1, 3)
    error *= largest_error / np.abs(error).max()
    times = np.linspace(0, 10 / gain, 50)
    inputs = -gain * error * np.exp(-gain * times)[:, None]
    assert np.abs(inputs).max() <= share * (1 + 1e-12)
    assert np.abs(1.01 * gain * error).max() > share


@given(st.floats(0.1, 3), st.floats(0, 0.5), st.floats(0, 0.5), st.floats(0.01, 2))
def test_a_field_at_the_limit_of_equation_31_just_uses_up_the_share(nu_max, mu, speed, gain):
    mu, speed = mu * nu_max, 0.9 * speed * nu_max
    if gain * speed >= nu_max - mu - speed:
        with pytest.raises(CertificateError):
            largest_field_speed(nu_max, mu, speed, gain)
        return
    field = largest_field_speed(nu_max, mu, speed, gain)
    # worst case: the grasp moves at full speed against the field
    assert gain * (speed + field) == pytest.approx(acceleration_share(nu_max, speed, mu))


def test_equation_31_alone_does_not_keep_the_papers_speed_bound():
    half = PAPERS_NU_MAX / 2
    field = largest_field_speed(PAPERS_NU_MAX, 0.0, half, gain=1.089e-4)
    assert field > 1000 * half


def test_scaling_falls_to_zero_with_the_margin_while_the_print_rises_to_one():
    speed = np.linspace(0.0, 1.2, 50) * PAPERS_NU_MAX
    scaling = margin_scaling(PAPERS_NU_MAX, 0.0, speed)
    assert np.all(np.diff(scaling) <= 0)
    assert scaling[0] == pytest.approx(np.tanh(1))
    assert np.all(scaling[speed >= PAPERS_NU_MAX] == 0)
    printed = 1 - np.tanh(PAPERS_NU_MAX - speed)
    within = speed <= PAPERS_NU_MAX
    assert np.all(np.diff(printed[within]) > 0)
    assert printed[within].min() > 0.99


@pytest.mark.parametrize("bad", [(0.0, 1.0), (1.0, 0.0), (float("nan"), 1.0)])
def test_senseless_bounds_are_refused(bad):
    with pytest.raises(ParameterError):
        semiglobal_gain(*bad)
