import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.stability import SampledLoop, force_loop_is_stable, smallest_k2

PERIOD_S = 0.02


def loop(**changes):
    beam = BeamParams()
    return SampledLoop(
        **{
            "robot": RobotParams(),
            "goal_pitch": np.array([np.pi / 2, 0.0]),
            "beam": beam,
            "linearization_beam": beam,
            "force_law_damping": 0.0,
            "gains": ForceLoopGains(k1=0.5, k2=2.0),
            "tracking_gain": 2.0,
            "approach_rate": 0.5,
            "period_s": PERIOD_S,
            **changes,
        }
    )


def force_error_after(gains, samples=3000):
    """Run Δu[k] = −k1 Δu[k−1] − k2 T Σ Δu from a unit error."""
    error, total = 1.0, 0.0
    for _ in range(samples):
        total += error
        error = -gains.k1 * error - gains.k2 * PERIOD_S * total
        if abs(error) > 1e6:
            break
    return abs(error)


@given(st.floats(0, 1.2), st.floats(0.5, 110))
def test_jurys_region_is_where_the_recursion_decays(k1, k2):
    gains = ForceLoopGains(k1=k1, k2=k2)
    edge = 2 * (1 - k1) / PERIOD_S
    assume(abs(k1 - 1) > 0.02 and abs(k2 - edge) > 0.02 * abs(edge) + 1)
    assert (force_error_after(gains) < 1e-3) == force_loop_is_stable(gains, PERIOD_S)


def test_jurys_edge_is_sharp():
    edge = 2 * (1 - 0.4) / PERIOD_S
    inside, outside = (ForceLoopGains(k1=0.4, k2=edge * share) for share in (0.98, 1.02))
    assert force_loop_is_stable(inside, PERIOD_S)
    assert force_error_after(inside) < 1e-3
    assert not force_loop_is_stable(outside, PERIOD_S)
    assert force_error_after(outside) > 1e3


def test_smallest_k2_is_the_square_of_the_lyapunov_eigenvalue():
    for gain in (1.089e-3, 0.5, 2.0):
        P = solve_continuous_lyapunov(-gain * np.eye(3), -np.eye(3))
        assert smallest_k2(gain) == pytest.approx(np.linalg.eigvalsh(P)[-1] ** 2)
    assert smallest_k2(1.089e-3) == pytest.approx(2.1e5, rel=0.01)


def test_no_computer_meets_the_papers_k2_at_its_own_gain():
    gains = ForceLoopGains(k1=0.0, k2=smallest_k2(1.089e-3))
    assert not force_loop_is_stable(gains, 1.1e-5)


@pytest.mark.parametrize(("damping", "stable"), [(0.0, True), (0.1, True), (1.0, False)])
def test_overestimated_damping_in_the_force_law_destabilizes(damping, stable):
    assert (loop(force_law_damping=damping).spectral_radius() < 1) == stable


def test_overestimated_damping_in_the_linearization_destabilizes_too():
    believed = BeamParams(damping=2.0)
    without_force_loop = ForceLoopGains(k1=0.0, k2=0.0)
    assert loop(gains=without_force_loop).spectral_radius() <= 1 + 1e-9
    changed = loop(gains=without_force_loop, linearization_beam=believed)
    assert changed.spectral_radius() > 1 + 1e-4


def test_k2_beyond_the_force_loops_edge_is_unstable_in_the_whole_loop():
    gains = ForceLoopGains(k1=0.4, k2=1.2 * 2 * (1 - 0.4) / PERIOD_S)
    assert loop(gains=gains).spectral_radius() > 1


def test_fast_sampling_recovers_the_effective_damping_of_the_force_law():
    # perfect force tracking leaves D_eff = d − 3 (d̂ − d) on a uniform rod
    beam = BeamParams(damping=0.5)
    inertia = beam.mass_kg * beam.length_m**2 / 3
    for assumed in (0.3, 0.6):
        fast = loop(
            beam=beam,
            linearization_beam=beam,
            force_law_damping=assumed,
            gains=ForceLoopGains(k1=0.0, k2=500.0),
            tracking_gain=1e-3,
            period_s=2e-4,
        )
        eigenvalues = np.log(np.linalg.eigvals(fast.transition_matrix()) + 0j) / 2e-4
        swing = eigenvalues[np.abs(np.abs(eigenvalues.imag) - 4.9) < 0.8]
        assert len(swing) == 2
        effective = beam.damping - 3 * (assumed - beam.damping)
        assert swing[0].real == pytest.approx(-effective / (2 * inertia), rel=0.06)
