import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.payload.object_model import HangingBeam

beams = st.builds(
    BeamParams,
    mass_kg=st.floats(0.1, 20),
    length_m=st.floats(0.2, 3),
    damping=st.floats(0, 5),
    segment_count=st.integers(1, 4),
    joint_stiffness=st.floats(0, 100),
    joint_damping=st.floats(0, 2),
)
seeds = st.integers(0, 2**32 - 1)


def random_motion(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.5, 0.5, count), rng.normal(size=count), np.array(rng.normal())


@given(beams, seeds)
def test_acceleration_error_inverts_the_linearizing_force(beam, seed):
    model, motion = HangingBeam(beam), random_motion(beam.segment_count, seed)
    u_o, error = np.random.default_rng(seed).normal(size=(2, 3))
    force = model.linearizing_force(*motion, u_o + error)
    np.testing.assert_allclose(
        model.acceleration_error(*motion, u_o, force), error, rtol=1e-6, atol=1e-6
    )


@given(beams, seeds)
def test_apparent_inertia_is_positive_and_below_the_mass(beam, seed):
    model = HangingBeam(beam)
    inertia = model.apparent_inertia(model.partition(*random_motion(beam.segment_count, seed)))
    eigenvalues = np.linalg.eigvalsh(inertia) / beam.mass_kg
    assert eigenvalues[0] > 0.01
    assert eigenvalues[-1] <= 1 + 1e-12


def test_uniform_rod_shows_a_quarter_of_its_mass_forward():
    beam = BeamParams()
    model = HangingBeam(beam)
    partition = model.partition(np.zeros(1), np.zeros(1), np.zeros(()))
    expected = beam.mass_kg * np.diag([0.25, 1.0, 1.0])
    np.testing.assert_allclose(model.apparent_inertia(partition), expected, atol=1e-12)


def test_force_law_damping_counts_threefold_for_a_uniform_rod():
    model = HangingBeam(BeamParams())
    partition = model.partition(np.zeros(1), np.zeros(1), np.zeros(()))
    coupling = partition.m_o12[:, 0]
    inverse = np.linalg.inv(model.apparent_inertia(partition))
    assert coupling @ inverse @ coupling / partition.m_o22[0, 0] == pytest.approx(3.0)


@given(seeds)
def test_rod_terms_equal_their_closed_form(seed):
    beam = BeamParams(radius_m=0.01)
    (swing,), (rate,), u2 = random_motion(1, seed)
    partition = HangingBeam(beam).partition(np.array([swing]), np.array([rate]), u2)
    moment, inertia = beam.mass_kg * beam.length_m / 2, beam.mass_kg * beam.length_m**2 / 3
    sin, cos = np.sin(swing), np.cos(swing)
    np.testing.assert_allclose(partition.m_o12[:, 0], [moment * cos, 0, moment * sin], atol=1e-12)
    np.testing.assert_allclose(partition.m_o22, [[inertia]])
    np.testing.assert_allclose(partition.t_o2, [moment * 9.81 * sin], atol=1e-9)
    centrifugal = inertia - beam.mass_kg * beam.radius_m**2 / 2
    np.testing.assert_allclose(partition.c_o2, [-centrifugal * u2**2 * sin * cos], atol=1e-9)


@given(beams, seeds)
def test_terms_do_not_depend_on_how_states_are_batched(beam, seed):
    model = HangingBeam(beam)
    first, second = (random_motion(beam.segment_count, seed + k) for k in range(2))
    force = np.array([1.0, -2.0, 30.0])
    batch = [np.stack(pair) for pair in zip(first, second, strict=True)]
    together = model.acceleration_error(*batch, np.zeros((2, 3)), np.stack((force, force)))
    for k, motion in enumerate((first, second)):
        single = model.acceleration_error(*motion, np.zeros(3), force)
        np.testing.assert_allclose(together[k], single, rtol=1e-9, atol=1e-9)


def test_assumed_damping_may_be_negative_but_not_nan():
    assert HangingBeam(BeamParams(), damping=-0.5).d_o22[0, 0] == -0.5
    with pytest.raises(ParameterError):
        HangingBeam(BeamParams(), damping=float("nan"))
