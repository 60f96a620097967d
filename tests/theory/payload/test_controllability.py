import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.payload.controllability import hautus_margin, is_controllable
from defmanip_gym.theory.payload.zero_dynamics import linearize

beams = st.builds(
    BeamParams,
    mass_kg=st.floats(1, 20),
    length_m=st.floats(0.6, 3),
    damping=st.floats(0, 5),
    segment_count=st.integers(1, 8),
    joint_stiffness=st.floats(0, 1e4),
    # segments that creep for minutes while others stop in milliseconds are beyond any such test
    joint_damping=st.floats(0, 0.2),
)


def without_one_mode(linear):
    """Return the forward input with its part on the slowest mode taken out."""
    eigenvalues, left = np.linalg.eig(linear.A_u.T)
    mode = left[:, np.abs(eigenvalues).argmin()]
    plane, _ = np.linalg.qr(np.stack((mode.real, mode.imag), axis=1))
    b = linear.forward_input[:, None]
    return b - plane @ (plane.T @ b)


@given(beams)
def test_forward_acceleration_reaches_every_mode_of_a_beam(beam):
    linear = linearize(beam)
    assert is_controllable(linear.A_u, linear.forward_input[:, None])
    assert is_controllable(linear.A_u, linear.B_u)


@pytest.mark.parametrize("count", [2, 5, 8])
def test_a_mode_that_no_input_excites_is_found(count):
    linear = linearize(BeamParams(segment_count=count, joint_stiffness=1e4))
    assert not is_controllable(linear.A_u, without_one_mode(linear))


@pytest.mark.parametrize("count", [1, 2])
def test_hautus_agrees_with_the_rank_of_ctrb_where_that_can_be_computed(count):
    linear = linearize(BeamParams(segment_count=count))
    reach = linear.forward_input[:, None]
    inputs = [reach] + ([without_one_mode(linear)] if count == 2 else [])
    for B in inputs:
        rank = np.linalg.matrix_rank(control.ctrb(linear.A_u, B))
        assert is_controllable(linear.A_u, B) == (rank == 2 * count)


def test_rank_of_ctrb_fails_a_stiff_beam_that_is_controllable():
    linear = linearize(BeamParams(segment_count=8, joint_stiffness=1e4))
    b = linear.forward_input[:, None]
    assert np.linalg.matrix_rank(control.ctrb(linear.A_u, b)) < 16
    assert hautus_margin(linear.A_u, b) > 1e-4


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_units_of_state_and_input_do_not_matter(state_unit, input_unit):
    linear = linearize(BeamParams(segment_count=3))
    scaling = np.diag([state_unit] * 3 + [1.0] * 3)
    A = scaling @ linear.A_u @ np.linalg.inv(scaling)
    b = input_unit * scaling @ linear.forward_input[:, None]
    margin = hautus_margin(linear.A_u, linear.forward_input[:, None])
    assert hautus_margin(A, b) == pytest.approx(margin, rel=9.0)


def test_no_input_reaches_nothing():
    assert not is_controllable(linearize(BeamParams()).A_u, np.zeros((2, 1)))
