import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.theory.control.continuous_loop import (
    closed_loop_matrix,
    lyapunov_w3,
    lyapunov_w3_rate,
)
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.stability import smallest_k2
from defmanip_gym.theory.payload.zero_dynamics import is_hurwitz, lyapunov_matrix

seeds = st.integers(0, 10**6)
tracking = st.floats(0.05, 5)


def random_hurwitz(seed):
    rng = np.random.default_rng(seed)
    L = rng.normal(size=(3, 3))
    return L - (np.linalg.eigvals(L).real.max() + rng.uniform(0.1, 2)) * np.eye(3)


def worst_state(L, gains):
    """Return the direction of (ė, Δu) along which Ẇ3 is largest."""
    P_e = lyapunov_matrix(L)
    form = np.block([[-np.eye(3), P_e], [P_e, -gains.k2 * np.eye(3)]])
    state = np.linalg.eigh(form)[1][:, -1]
    return state[:3], state[3:]


@given(st.floats(0, 3), st.floats(0.1, 30), st.floats(-2, 2), st.floats(-2, 2))
def test_matrix_is_equations_32_and_33a(k1, k2, velocity_error, error):
    L = np.array([[-0.7]])
    matrix = closed_loop_matrix(L, ForceLoopGains(k1=k1, k2=k2))
    acceleration, error_rate = matrix @ [velocity_error, error]
    assert acceleration == pytest.approx(-0.7 * velocity_error + error)
    # (27) and (29) leave Δu = −k1 Δu − k2 ∫Δu, here differentiated
    assert error_rate == pytest.approx(-k1 * error_rate - k2 * error)


@given(seeds, st.floats(0, 2), st.floats(0.1, 20), st.floats(0.2, 5))
def test_rate_of_w3_is_its_slope_along_the_loop(seed, k1, k2, weight):
    L, gains = random_hurwitz(seed), ForceLoopGains(k1=k1, k2=k2)
    velocity_error, error = np.random.default_rng(seed).normal(size=(2, 3))
    motion = closed_loop_matrix(L, gains) @ np.concatenate((velocity_error, error))
    step = 1e-6

    def w3(t):
        return lyapunov_w3(
            L, gains, velocity_error + t * motion[:3], error + t * motion[3:], weight
        )

    slope = (w3(step) - w3(-step)) / (2 * step)
    rate = lyapunov_w3_rate(L, gains, velocity_error, error, weight)
    assert slope == pytest.approx(rate, rel=1e-5, abs=1e-6)


@given(tracking, st.floats(0, 2))
def test_w3_decreases_from_every_state_just_above_the_smallest_k2_only(gain, k1):
    L = -gain * np.eye(3)
    above = ForceLoopGains(k1=k1, k2=1.01 * smallest_k2(gain))
    below = ForceLoopGains(k1=k1, k2=0.99 * smallest_k2(gain))
    assert lyapunov_w3_rate(L, above, *worst_state(L, above)) < 0
    assert lyapunov_w3_rate(L, below, *worst_state(L, below)) > 0


@given(seeds, st.floats(0, 2), st.floats(1e-3, 20))
def test_the_loop_is_stable_for_every_positive_k2(seed, k1, k2):
    L, gains = random_hurwitz(seed), ForceLoopGains(k1=k1, k2=k2)
    assert is_hurwitz(closed_loop_matrix(L, gains))
    # and another weight on Δu_o in W3 proves it
    weight = 1.01 * np.linalg.eigvalsh(lyapunov_matrix(L))[-1] ** 2 / k2
    velocity_error, error = np.random.default_rng(seed).normal(size=(2, 200, 3))
    error *= np.geomspace(1e-3, 1e3, 200)[:, None]
    assert np.all(lyapunov_w3_rate(L, gains, velocity_error, error, weight) < 0)


def test_printed_last_step_of_the_proof_does_not_hold():
    # −(‖ė‖ − ‖Δu‖)² there should be −(λ_M/√k2 ‖ė‖ − √k2 ‖Δu‖)²
    gain = 0.5
    L, largest = -gain * np.eye(3), 1 / (2 * gain)
    gains = ForceLoopGains(k1=0.0, k2=4.0 * smallest_k2(gain))
    speed, error = 4.0 * np.eye(3)[0], np.eye(3)[0]
    a, b = np.linalg.norm(speed), np.linalg.norm(error)
    rate = lyapunov_w3_rate(L, gains, speed, error)
    slack = (1 - largest**2 / gains.k2) * a**2
    root = np.sqrt(gains.k2)
    assert rate > -((a - b) ** 2) - slack
    assert rate == pytest.approx(-((largest / root * a - root * b) ** 2) - slack)
