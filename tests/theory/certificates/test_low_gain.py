import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nonlinear_beam import largest_swing, one_hinge_acceleration
from scipy.linalg import expm

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.acceleration_budget import acceleration_share, semiglobal_gain
from defmanip_gym.theory.certificates.low_gain import (
    internal_feedback,
    largest_epsilon,
    largest_feedback,
    stabilize,
    stabilizing_feedback,
)
from defmanip_gym.theory.payload.zero_dynamics import is_hurwitz, linearize

SIGMA, MU = math.pi / 6, 1.0
ROD = BeamParams(damping=0.0)


@pytest.fixture(scope="module")
def rod_feedback():
    return stabilize(linearize(ROD), SIGMA, MU)


def undamped(count):
    return BeamParams(damping=0.0, joint_damping=0.0, segment_count=count)


def riccati_residual(linear, H, epsilon):
    """Return the residual of the Riccati equation for P rebuilt from H by its Lyapunov form."""
    A, b = linear.A_u, linear.forward_input
    closed = A + np.outer(b, H)
    size = len(b)
    operator = np.kron(closed.T, np.eye(size)) + np.kron(np.eye(size), closed.T)
    right = -(epsilon * np.eye(size) + np.outer(H, H))
    P = np.linalg.solve(operator, right.ravel()).reshape(size, size)
    return np.abs(b @ P + H).max()


@settings(max_examples=15)
@given(
    st.builds(
        BeamParams,
        mass_kg=st.floats(0.5, 10),
        length_m=st.floats(0.5, 2),
        damping=st.sampled_from([0.0, 0.1]),
        joint_damping=st.just(0.0),
        segment_count=st.integers(1, 3),
    ),
    st.floats(-3, 2),
)
def test_feedback_solves_the_riccati_equation_and_makes_the_object_hurwitz(beam, exponent):
    linear, epsilon = linearize(beam), 10.0**exponent
    H = stabilizing_feedback(linear, epsilon)
    assert is_hurwitz(linear.A_u + np.outer(linear.forward_input, H))
    assert riccati_residual(linear, H, epsilon) < 1e-6 * (1 + np.abs(H).max())


@pytest.mark.parametrize("count", [1, 3])
def test_feedback_vanishes_with_epsilon(count):
    linear = linearize(undamped(count))
    sizes = [
        np.linalg.norm(stabilizing_feedback(linear, epsilon)) for epsilon in (1.0, 1e-3, 1e-6, 1e-9)
    ]
    assert sizes[3] < sizes[2] < sizes[1] < sizes[0]
    # H is of the order of √ε
    assert sizes[3] / sizes[2] == pytest.approx(math.sqrt(1e-3), rel=0.05)


def test_feedback_of_one_hinge_has_its_closed_form():
    linear = linearize(ROD)
    stiffness, b = -linear.A_u[1, 0], linear.forward_input[1]
    epsilon = 0.3
    # a11: 2 P12 ω² + P12² b² = ε, a22: 2 P12 − P22² b² + ε = 0
    P12 = (math.sqrt(stiffness**2 + epsilon * b**2) - stiffness) / b**2
    P22 = math.sqrt(2 * P12 + epsilon) / abs(b)
    np.testing.assert_allclose(stabilizing_feedback(linear, epsilon), [-b * P12, -b * P22])


@pytest.mark.parametrize(("mu", "count"), [(0.1, 1), (3.0, 2)])
def test_largest_epsilon_just_keeps_the_feedback_within_mu(mu, count):
    linear = linearize(undamped(count))
    extent = np.concatenate((np.full(count, SIGMA), np.full(count, 5 * SIGMA)))
    epsilon = largest_epsilon(linear, mu, extent)
    assert largest_feedback(stabilizing_feedback(linear, epsilon), extent) <= mu
    beyond = stabilizing_feedback(linear, 1.01 * epsilon)
    assert largest_feedback(beyond, extent) > mu
    corner = np.sign(beyond) * extent
    assert corner @ beyond == pytest.approx(largest_feedback(beyond, extent))


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("epsilon", [1e-2, 1.0, 1e2])
def test_equation_19_has_no_room_where_the_feedback_is_only_assumed(count, epsilon):
    # (24)–(26): disturbances of size ν_max cause |Hη| up to g_H ν_max, which μ has to cover
    feedback = internal_feedback(linearize(undamped(count)), SIGMA, MU, epsilon)
    best_nu_max = SIGMA / feedback.swing_gain
    mu_needed = feedback.feedback_gain * best_nu_max
    assert mu_needed >= best_nu_max
    with pytest.raises(CertificateError):
        acceleration_share(best_nu_max, 0.0, mu_needed)


def test_the_gain_at_resonance_is_why():
    # H (jωI − A_u − bH)⁻¹ b = −1 at an eigenvalue jω of A_u, and no peak gain is below |·| there
    linear = linearize(undamped(2))
    feedback = internal_feedback(linear, SIGMA, MU, 0.1)
    for root in np.linalg.eigvals(linear.A_u):
        response = np.linalg.solve(root * np.eye(4) - feedback.matrix, linear.forward_input)
        assert feedback.H @ response == pytest.approx(-1.0, abs=1e-6)


def test_weakest_feedback_of_one_hinge_leaves_pi_quarters_of_mu():
    feedback = stabilize(linearize(ROD), SIGMA, 0.1)
    assert feedback.acceleration_bound == pytest.approx(math.pi / 4 * 0.1, rel=0.01)
    assert feedback.total_acceleration <= feedback.acceleration_bound + 0.1 + 1e-12


@pytest.mark.parametrize("mu", [0.2, 5.0])
def test_sigma_and_mu_are_both_used_up(mu):
    feedback = stabilize(linearize(ROD), SIGMA, mu)
    share = feedback.acceleration_bound
    assert share * feedback.feedback_gain == pytest.approx(mu, rel=0.02)
    assert share * feedback.swing_gain == pytest.approx(SIGMA, rel=0.02)


def worst_disturbance(feedback, output, duration_s, period_s):
    """Return v(t) that drives output @ η highest at the end of the linear model."""
    steps = round(duration_s / period_s)
    advance = expm(feedback.matrix * period_s)
    state, signs = feedback.linear.forward_input, np.empty(steps)
    for k in range(steps):
        signs[steps - 1 - k] = np.sign(output @ state)
        state = advance @ state
    return feedback.acceleration_bound * signs


@pytest.mark.parametrize("target", ["swing", "feedback"])
def test_worst_disturbance_stays_within_sigma_and_mu_only_where_the_feedback_is_applied(
    target, rod_feedback
):
    feedback = rod_feedback
    period, duration = 0.01, 20.0
    output = np.array([1.0, 0.0]) if target == "swing" else feedback.H
    v = worst_disturbance(feedback, output, duration, period)
    largest = np.zeros(1)

    def commands(applied):
        def command(t, phi, rate):
            fed_back = feedback.acceleration(np.stack((phi, rate), axis=-1))
            if applied:
                np.maximum(largest, np.abs(fed_back), out=largest)
            return applied * fed_back + v[round(t / period)], 0.0, 0.0

        return command

    def peak(applied):
        return largest_swing(
            one_hinge_acceleration(ROD),
            commands(applied),
            np.zeros(1),
            duration_s=duration,
            period_s=period,
        )[0]

    with_feedback = peak(1.0)
    assert with_feedback <= SIGMA
    assert largest[0] <= MU
    assert with_feedback > 0.9 * SIGMA
    assert peak(0.0) > 1.5 * SIGMA


def test_without_feedback_a_hundredth_of_it_at_resonance_breaks_sigma(rod_feedback):
    bound = 1e-2 * rod_feedback.acceleration_bound

    def pumping(_, __, rate):
        return -bound * np.sign(rate + 1e-12), 0.0, 0.0

    # the amplitude grows by 2 bound/g per half swing
    peak = largest_swing(
        one_hinge_acceleration(ROD), pumping, np.full(1, 0.45), duration_s=60.0, period_s=0.02
    )
    assert peak[0] > SIGMA


@pytest.mark.parametrize("count", [1, 2])
def test_tracking_with_the_semiglobal_gain_is_stable_together_with_the_object(count):
    feedback = stabilize(linearize(undamped(count)), SIGMA, MU)
    gain = semiglobal_gain(feedback.acceleration_bound, largest_error=1.0)
    assert is_hurwitz(feedback.tracking_matrix(gain))


def test_tracking_matrix_is_the_motion_under_the_sum_of_both_feedbacks(rod_feedback):
    linear, gain, error, eta = rod_feedback.linear, 0.4, 0.7, np.array([0.1, -0.3])
    u_o = rod_feedback.acceleration(eta) - gain * error
    expected = np.concatenate(([u_o], linear.A_u @ eta + linear.forward_input * u_o))
    motion = rod_feedback.tracking_matrix(gain) @ np.concatenate(([error], eta))
    np.testing.assert_allclose(motion, expected, atol=1e-12)


def test_saturated_tracking_reaches_the_speed_within_sigma_and_leaves_no_swing(rod_feedback):
    feedback = rod_feedback
    share, gain, target, period = feedback.acceleration_bound, 1.0, 1.0, 0.01
    speed = np.zeros(1)

    def command(_, phi, rate):
        v = np.clip(gain * (target - speed), -share, share)
        u_o = v + feedback.acceleration(np.stack((phi, rate), axis=-1))
        speed[:] += period * u_o
        command.last = np.array([phi[0], rate[0], speed[0]])
        return u_o, 0.0, 0.0

    peak = largest_swing(
        one_hinge_acceleration(ROD), command, np.zeros(1), duration_s=25.0, period_s=period
    )
    assert peak[0] <= SIGMA
    np.testing.assert_allclose(command.last, [0.0, 0.0, target], atol=1e-3)


@settings(max_examples=4)
@given(st.floats(0.1, 1), st.floats(0.05, 5), st.floats(0.3, 2))
def test_bounds_hold_for_any_rod(sigma, mu, length):
    feedback = stabilize(linearize(BeamParams(damping=0.0, length_m=length)), sigma, mu)
    share = feedback.acceleration_bound
    assert is_hurwitz(feedback.matrix)
    assert 0 < share <= mu
    assert share * feedback.swing_gain <= sigma * (1 + 1e-9)
    assert share * feedback.feedback_gain <= mu * (1 + 1e-9)


def test_what_cannot_be_stabilized_is_refused():
    linear = linearize(ROD)
    with pytest.raises(ParameterError):
        stabilize(linear, SIGMA, 0.0)
    with pytest.raises(ParameterError):
        stabilize(linear, 2.0, MU)
    with pytest.raises(ParameterError):
        stabilizing_feedback(linear, -1.0)
