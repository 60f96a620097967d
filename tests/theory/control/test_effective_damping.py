from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigvals

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.effective_damping import (
    apparent_inertia,
    effective_damping,
    force_tracking_gain,
    largest_assumed_damping_factor,
    under_force_tracking,
)
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.zero_dynamics import is_hurwitz, linearize

beams = st.builds(
    BeamParams,
    mass_kg=st.floats(0.1, 20),
    length_m=st.floats(0.4, 3),
    damping=st.floats(0.05, 5),
    segment_count=st.integers(1, 4),
    joint_stiffness=st.floats(0, 100),
    joint_damping=st.floats(0.05, 2),
)


@given(beams, st.floats(0, 4))
def test_it_is_what_the_force_law_makes_of_the_object(beam, assumed):
    # apply Eq. (10) with the assumed damping, solve (6) for z̈_2, read off the damping
    true, law = HangingBeam(beam), HangingBeam(beam, damping=assumed)
    linear, rest = linearize(beam), np.zeros(beam.segment_count)
    partition = true.partition(rest, rest, np.zeros(()))
    step, torques = 1e-4, []
    for unit in np.eye(beam.segment_count):
        rate = step * unit
        # velocities so small that c_o1, c_o2 vanish
        force = law.linearizing_force(rest, rate, np.zeros(()), np.zeros(3))
        grasp = true.acceleration_error(rest, rate, np.zeros(()), np.zeros(3), force)
        torque = true.internal_torque(partition, rest, rate) + partition.m_o12.T @ grasp
        torques.append(torque / step)
    expected = effective_damping(linear, law.d_o22)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(np.stack(torques, axis=1), expected, atol=2e-3 * scale)


@settings(max_examples=10)
@given(st.floats(0.1, 20), st.floats(0.2, 3), st.floats(0.01, 5), st.floats(-1, 5))
def test_one_uniform_rod_has_gain_three_and_stands_a_third_too_much(mass, length, damping, assumed):
    linear = linearize(BeamParams(mass_kg=mass, length_m=length, damping=damping))
    np.testing.assert_allclose(force_tracking_gain(linear), [[3.0]])
    expected = damping - 3 * (assumed - damping)
    np.testing.assert_allclose(
        effective_damping(linear, np.array([[assumed]])), [[expected]], atol=1e-9
    )
    assert largest_assumed_damping_factor(linear) == pytest.approx(4 / 3, rel=1e-6)


@settings(max_examples=15)
@given(beams)
def test_factor_is_where_an_eigenvalue_reaches_the_imaginary_axis(beam):
    linear = linearize(beam)
    factor = largest_assumed_damping_factor(linear)
    assert 1 < factor < 10

    def fastest_growth(share):
        A = under_force_tracking(linear, share * factor * linear.d_o22).A_u
        return eigvals(A).real.max()

    assert fastest_growth(1 - 1e-6) < 0
    assert fastest_growth(1 + 1e-6) > 0
    between = 1 + (factor - 1) * np.linspace(0, 0.999, 7)
    assert all(fastest_growth(c / factor) < 0 for c in between)


@given(beams)
def test_true_damping_in_the_force_law_changes_nothing(beam):
    linear = linearize(beam)
    np.testing.assert_array_equal(effective_damping(linear, linear.d_o22), linear.d_o22)


def test_more_segments_stand_less():
    factors = [
        largest_assumed_damping_factor(linearize(BeamParams(segment_count=count)))
        for count in (1, 2, 3, 5)
    ]
    assert np.all(np.diff(factors) < 0)
    assert factors[-1] < 1.02


@given(beams)
def test_a_force_law_without_damping_from_the_vertical_leaves_every_beam_stable(beam):
    # the joints' damping known, as in HangingBeam(beam, damping=0); evidence, no proof
    linear = linearize(beam)
    assumed = HangingBeam(beam, damping=0.0).d_o22
    assert is_hurwitz(under_force_tracking(linear, assumed).A_u)


def test_a_force_law_without_any_damping_can_destabilize_a_soft_chain():
    # for one hinge it only adds damping; Γ D is not symmetric for more
    soft = BeamParams(
        mass_kg=0.52,
        length_m=1.84,
        damping=0.02,
        joint_damping=0.24,
        joint_stiffness=0.5,
        segment_count=3,
    )
    for beam, is_stable in ((soft, False), (replace(soft, segment_count=1), True)):
        linear = linearize(beam)
        assert is_hurwitz(linear.A_u)
        assert is_hurwitz(under_force_tracking(linear, 0 * linear.d_o22).A_u) == is_stable


def test_a_point_mass_on_a_string_is_refused():
    rod = linearize(BeamParams())
    moment, mass = rod.m_o12[0, 0], rod.m_o11[0, 0]
    point = replace(rod, m_o22=np.array([[moment**2 / mass]]))
    for function in (apparent_inertia, force_tracking_gain, largest_assumed_damping_factor):
        with pytest.raises(ParameterError, match="point mass"):
            function(point)


def test_an_undamped_object_is_refused():
    with pytest.raises(ParameterError, match="Hurwitz"):
        largest_assumed_damping_factor(linearize(BeamParams(damping=0.0)))
