import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.impulse_response import peak_gains
from defmanip_gym.theory.certificates.iss_gain import deformation_bound, iss_gain
from defmanip_gym.theory.payload.zero_dynamics import linearize, lyapunov_matrix


def test_gain_is_equation_17_and_linear_in_its_argument():
    P = np.diag([2.0, 8.0, 3.0, 4.0])
    # 4 √(2 · 2³) · 8 · √(8/2)
    assert iss_gain(P, 2, 1.0) == pytest.approx(4 * 4 * 8 * 2)
    assert iss_gain(P, 2, 0.3) == pytest.approx(0.3 * iss_gain(P, 2, 1.0))


@settings(max_examples=10)
@given(
    st.builds(
        BeamParams,
        damping=st.floats(0.3, 5),
        segment_count=st.integers(1, 3),
        joint_stiffness=st.floats(1, 50),
        joint_damping=st.floats(0.2, 1),
    ),
    st.floats(0.01, 3),
)
def test_no_input_takes_the_object_beyond_equation_21(beam, acceleration):
    linear = linearize(beam)
    b = linear.forward_input[:, None]
    largest = acceleration * peak_gains(linear.A_u, b, np.eye(len(b))).max()
    bound = deformation_bound(lyapunov_matrix(linear.A_u), b, np.array([acceleration]))
    assert largest <= bound


def test_papers_bound_is_three_orders_above_what_inputs_can_do():
    linear = linearize(BeamParams(damping=1.0))
    b = linear.forward_input[:, None]
    exact = peak_gains(linear.A_u, b, np.eye(2))[0, 0]
    bound = deformation_bound(lyapunov_matrix(linear.A_u), b, np.ones(1))
    assert 500 < bound / exact < 5000
    assert math.isfinite(bound)
