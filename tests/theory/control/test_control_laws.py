import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.control.control_laws import (
    ForceLoopGains,
    force_loop,
    integrate_unless_saturated,
    limit_speed,
    saturated_tracking,
)

PERIOD_S, LIMIT = 0.02, 2.0
accelerations = arrays(float, (3,), elements=st.floats(-6, 6))
velocities = arrays(float, (3,), elements=st.floats(-3, 3))
norm = np.linalg.norm


@given(accelerations, velocities)
def test_limited_command_is_never_longer(w, v):
    assert norm(limit_speed(w, v, LIMIT, PERIOD_S)) <= norm(w) + 1e-9


@given(accelerations, velocities)
def test_speed_ahead_stays_below_the_limit_or_the_present_speed(w, v):
    ahead = v + PERIOD_S * limit_speed(w, v, LIMIT, PERIOD_S)
    assert norm(ahead) <= max(LIMIT, norm(v)) + 1e-9


@given(accelerations, velocities)
def test_braking_passes_unchanged(w, v):
    assume(norm(v + PERIOD_S * w) <= norm(v))
    np.testing.assert_array_equal(limit_speed(w, v, LIMIT, PERIOD_S), w)


@given(accelerations, velocities)
def test_no_other_allowed_command_is_closer(w, v):
    limited = limit_speed(w, v, LIMIT, PERIOD_S)
    allowed = max(LIMIT, norm(v))
    for shift in 1e-3 * np.concatenate((np.eye(3), -np.eye(3))):
        if norm(v + PERIOD_S * (limited + shift)) <= allowed:
            assert norm(limited + shift - w) >= norm(limited - w) - 1e-6


def test_limit_acts_on_each_of_a_batch():
    w = np.array([[5.0, 0, 0], [5.0, 0, 0]])
    v = np.array([[1.99, 0, 0], [0.0, 0, 0]])
    limited = limit_speed(w, v, LIMIT, PERIOD_S)
    np.testing.assert_allclose(limited, [[0.5, 0, 0], [5.0, 0, 0]], atol=1e-9)


@given(accelerations, accelerations, accelerations)
def test_integral_never_grows_while_it_pushes_out_of_saturation(integral, error, w):
    bound = np.full(3, 2.0)
    following = integrate_unless_saturated(integral, error, w, bound, PERIOD_S)
    held = following == integral
    # w falls as the integral grows
    worse = (np.abs(w) >= bound) & (np.sign(w) * np.sign(error) < 0)
    np.testing.assert_array_equal(held, worse | (integral + PERIOD_S * error == integral))
    free = ~worse
    np.testing.assert_allclose(following[free], (integral + PERIOD_S * error)[free])


def test_saturated_loop_does_not_wind_up():
    gains, bound = ForceLoopGains(k1=0.5, k2=2.0), np.full(3, 1.0)
    integral, error = np.zeros(3), np.full(3, 0.8)
    for _ in range(1000):
        w = force_loop(np.zeros(3), error, integral + PERIOD_S * error, gains)
        integral = integrate_unless_saturated(integral, error, w, bound, PERIOD_S)
    assert (np.abs(gains.k2 * integral) <= 1.0).all()


@given(velocities, accelerations)
def test_tracking_opposes_the_error_within_its_bound(error, feedforward):
    bound = np.array([1.0, 2.0, 0.5])
    u_o = saturated_tracking(error, 2.0, bound, feedforward)
    assert (np.abs(u_o) <= bound).all()
    inside = np.abs(feedforward - 2 * error) < bound
    np.testing.assert_allclose(u_o[inside], (feedforward - 2 * error)[inside])


def test_force_loop_is_equation_29():
    u_o, error, integral = np.array([1.0, 0.1, 0.3])[:, None] * np.eye(3)[0]
    w = force_loop(u_o, error, integral, ForceLoopGains(k1=2, k2=3))
    np.testing.assert_allclose(w, [1 - 0.2 - 0.9, 0, 0])


@pytest.mark.parametrize("gains", [{"k1": -0.1}, {"k2": -1.0}, {"k2": float("nan")}])
def test_bad_gains_are_refused(gains):
    with pytest.raises(ParameterError):
        ForceLoopGains(**gains)
