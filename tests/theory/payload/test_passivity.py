import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nonlinear_beam import chain_acceleration
from scipy.integrate import solve_ivp

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.passivity import coriolis_matrix, dissipation, storage
from defmanip_gym.theory.payload.zero_dynamics import equilibrium, linearize

beams = st.builds(
    BeamParams,
    mass_kg=st.floats(0.1, 20),
    length_m=st.floats(0.2, 3),
    damping=st.floats(0, 5),
    segment_count=st.integers(1, 4),
    joint_stiffness=st.floats(0, 100),
    joint_damping=st.floats(0, 2),
    root_stiffness=st.floats(0, 10),
)
seeds = st.integers(0, 10**6)
STEP = 1e-6


def random_state(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 2, count), rng.normal(size=count), rng.normal(size=(2, 3))


@given(beams, seeds)
def test_energy_changes_by_the_work_at_the_grasp_less_what_dampers_take(beam, seed):
    model = HangingBeam(beam)
    swing, rate, (velocity, acceleration) = random_state(beam.segment_count, seed)
    partition = model.partition(swing, rate, np.zeros(()))
    torque = model.internal_torque(partition, swing, rate) + partition.m_o12.T @ acceleration
    swing_acceleration = -np.linalg.solve(partition.m_o22, torque)
    force = model.linearizing_force(swing, rate, np.zeros(()), acceleration)

    def energy(t):
        return storage(
            model,
            swing + t * rate + 0.5 * t**2 * swing_acceleration,
            rate + t * swing_acceleration,
            velocity + t * acceleration,
        )

    slope = (energy(STEP) - energy(-STEP)) / (2 * STEP)
    work = (force - partition.t_o1) @ velocity
    scale = 1 + abs(work) + np.abs(torque).max() * np.abs(rate).max()
    assert slope == pytest.approx(work - dissipation(model, rate), abs=1e-5 * scale)


@pytest.mark.parametrize("count", [1, 3])
def test_with_the_grasp_at_rest_the_energy_only_falls_until_the_beam_hangs(count):
    beam = BeamParams(damping=0.8, segment_count=count)
    model, acceleration = HangingBeam(beam), chain_acceleration(beam)

    def slope(_, state):
        swing, rate = state[None, :count], state[None, count : 2 * count]
        following = acceleration(swing, rate, np.zeros(1), np.zeros(1), np.zeros(1))
        lost = dissipation(model, rate)
        return np.concatenate((rate[0], following[0], lost))

    start = np.concatenate((np.full(count, 2.0), np.zeros(count + 1)))
    motion = solve_ivp(slope, (0, 12), start, rtol=1e-7, atol=1e-9, method="LSODA").y
    energy = storage(model, motion[:count].T, motion[count : 2 * count].T)
    # V(t) = V(0) − ∫ ż2ᵀ d_o22 ż2
    np.testing.assert_allclose(energy, energy[0] - motion[-1], atol=1e-5 * energy[0])
    assert np.diff(energy).max() < 1e-6 * energy[0]
    np.testing.assert_allclose(motion[:count, -1], equilibrium(beam), atol=1e-3)


@given(beams, seeds)
def test_inertia_rate_less_twice_coriolis_is_skew_symmetric(beam, seed):
    model = HangingBeam(beam)
    swing, rate, _ = random_state(beam.segment_count, seed)

    def inertia(t):
        return model.partition(swing + t * rate, rate, np.zeros(())).m_o22

    inertia_rate = (inertia(STEP) - inertia(-STEP)) / (2 * STEP)
    coriolis = coriolis_matrix(model, swing, rate)
    difference = inertia_rate - 2 * coriolis
    np.testing.assert_allclose(difference, -difference.T, atol=1e-6 * np.abs(inertia(0)).max())
    c_o2 = model.partition(swing, rate, np.zeros(())).c_o2
    np.testing.assert_allclose(coriolis @ rate, c_o2, atol=1e-10 * (1 + np.abs(c_o2).max()))


def test_upright_is_an_equilibrium_too_so_the_lemma_is_not_global():
    beam = BeamParams(damping=0.8)
    model, still = HangingBeam(beam), np.zeros(1)
    upright = np.array([np.pi])
    torque = model.internal_torque(model.partition(upright, still, np.zeros(())), upright, still)
    np.testing.assert_allclose(torque, 0.0, atol=1e-12)
    assert storage(model, upright, still) > 0


@given(beams)
def test_no_beam_has_an_eigenvalue_in_the_open_right_half_plane(beam):
    # Lemma III.2, with and without damping
    for damping in (1.0, 0.0):
        eigenvalues = np.linalg.eigvals(linearize(beam).scaled(damping=damping).A_u)
        assert eigenvalues.real.max() <= 1e-9 * np.abs(eigenvalues).max()


def test_batches_equal_single_states():
    model = HangingBeam(BeamParams(segment_count=2))
    swing, rate = np.random.default_rng(0).normal(size=(2, 3, 4, 2))
    together = storage(model, swing, rate)
    matrices = coriolis_matrix(model, swing, rate)
    for index in np.ndindex(3, 4):
        assert together[index] == pytest.approx(storage(model, swing[index], rate[index]))
        np.testing.assert_allclose(
            matrices[index], coriolis_matrix(model, swing[index], rate[index])
        )
