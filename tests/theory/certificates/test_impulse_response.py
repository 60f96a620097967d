import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.impulse_response import peak_free_response, peak_gains
from defmanip_gym.theory.payload.zero_dynamics import linearize


@given(st.floats(0.01, 0.95), st.floats(0.5, 50))
def test_gain_of_an_oscillator_has_its_closed_form(zeta, omega):
    A = np.array([[0, 1], [-(omega**2), -2 * zeta * omega]])
    gain = peak_gains(A, np.array([[0.0], [1.0]]), np.eye(1, 2))[0, 0]
    exact = 1 / (omega**2 * math.tanh(math.pi * zeta / (2 * math.sqrt(1 - zeta**2))))
    assert gain == pytest.approx(exact, rel=3e-4)


def test_gain_of_an_overdamped_system_is_its_static_gain():
    A = np.array([[0, 1], [-4.0, -100.0]])
    gain = peak_gains(A, np.array([[0.0], [1.0]]), np.eye(1, 2))[0, 0]
    assert gain == pytest.approx(1 / 4.0, rel=3e-4)


def test_gain_of_three_segments_agrees_with_its_modal_sum():
    linear = linearize(BeamParams(damping=1.0, segment_count=3, joint_stiffness=2.0))
    eigenvalues, modes = np.linalg.eig(linear.A_u)
    weights = modes[2] * np.linalg.solve(modes, linear.forward_input)
    times = np.linspace(0, 15.0, 150_001)
    response = (np.exp(times[:, None] * eigenvalues) @ weights).real
    exact = np.trapezoid(np.abs(response), times)
    gain = peak_gains(linear.A_u, linear.forward_input[:, None], np.eye(3, 6))[2, 0]
    assert gain == pytest.approx(exact, rel=3e-4)


def test_free_response_peaks_no_lower_than_any_sample():
    beam = BeamParams(damping=0.3, segment_count=3, joint_stiffness=2.0)
    A, start = linearize(beam).A_u, np.array([0.1, 0.1, 0.1, 0, 0, 0])
    peak = peak_free_response(A, start[:, None], np.eye(3, 6))
    samples = [np.abs(expm(A * t) @ start)[:3] for t in np.random.default_rng(0).uniform(0, 9, 300)]
    assert (np.max(samples, axis=0) <= peak * (1 + 1e-4)).all()
    assert (np.abs(start[:3]) <= peak).all()
