import sys

import numpy as np
import pytest
from nonlinear_beam import chain_acceleration

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.payload.zero_dynamics import (
    equilibrium,
    is_hurwitz,
    linearize,
    lyapunov_matrix,
)

BEAMS = [
    BeamParams(damping=0.4),
    BeamParams(damping=0.4, segment_count=2, joint_stiffness=3.0),
    BeamParams(mass_kg=1.0, length_m=1.5, segment_count=4),
]
STEP = 1e-5


def rates(beam, eta, *, forward=0.0, upward=0.0, yaw_rate=0.0):
    swing, swing_rate = np.split(np.asarray(eta)[None], 2, axis=1)
    acceleration = chain_acceleration(beam)(
        swing, swing_rate, np.array([forward]), np.array([upward]), np.array([yaw_rate])
    )
    return np.concatenate((swing_rate[0], acceleration[0]))


def slope(function, count):
    """Central differences of ``function`` (count,) → (k,)."""
    columns = [
        (function(STEP * unit) - function(-STEP * unit)) / (2 * STEP) for unit in np.eye(count)
    ]
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("beam", BEAMS)
def test_linearization_is_the_slope_of_the_nonlinear_object(beam):
    linear, size = linearize(beam), 2 * beam.segment_count
    at_rest = slope(lambda eta: rates(beam, eta), size)
    np.testing.assert_allclose(linear.A_u, at_rest, atol=1e-6 * np.abs(at_rest).max())
    forward = slope(lambda a: rates(beam, np.zeros(size), forward=a[0]), 1)
    np.testing.assert_allclose(linear.forward_input[:, None], forward, atol=1e-6)
    upward = slope(lambda a: rates(beam, np.zeros(size), upward=a[0]), 1)
    np.testing.assert_allclose(linear.B_u[:, 8:], upward, atol=1e-6)
    assert not linear.B_u[:, :6].any()


@pytest.mark.parametrize("beam", BEAMS)
def test_stiffness_perturbations_are_the_slope_under_lifting_and_yaw(beam):
    linear, count = linearize(beam), beam.segment_count
    lifted = slope(lambda eta: rates(beam, eta, upward=0.7), 2 * count)
    effect = -linear.torque_input(linear.vertical_stiffness)
    np.testing.assert_allclose((lifted - linear.A_u)[count:, :count], 0.7 * effect, atol=1e-5)
    turned = slope(lambda eta: rates(beam, eta, yaw_rate=1.3), 2 * count)
    effect = linear.torque_input(linear.centrifugal_stiffness)
    np.testing.assert_allclose((turned - linear.A_u)[count:, :count], 1.3**2 * effect, atol=1e-5)


@pytest.mark.parametrize("beam", BEAMS)
def test_lyapunov_matrix_solves_its_equation(beam):
    A = linearize(beam).A_u
    P = lyapunov_matrix(A)
    np.testing.assert_allclose(P @ A + A.T @ P, -np.eye(len(A)), atol=1e-8 * np.abs(P).max())
    assert np.linalg.eigvalsh(P)[0] > 0


@pytest.mark.parametrize("beam", BEAMS)
def test_beam_rests_hanging_straight_down(beam):
    still = np.concatenate((equilibrium(beam), np.zeros(beam.segment_count)))
    np.testing.assert_allclose(rates(beam, still), 0.0, atol=1e-12)


def test_damping_decides_whether_the_object_is_hurwitz():
    assert is_hurwitz(linearize(BeamParams(damping=1e-3)).A_u)
    assert not is_hurwitz(linearize(BeamParams(damping=0.0)).A_u)
    undamped = BeamParams(damping=0.0, joint_damping=0.0, segment_count=3)
    assert not is_hurwitz(linearize(undamped).A_u)


def test_theory_does_not_load_the_simulator():
    import subprocess

    code = (
        "import defmanip_gym.theory.certificates, defmanip_gym.theory.control.stability, sys;"
        "sys.exit('mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
