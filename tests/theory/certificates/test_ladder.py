import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import (
    CERTIFICATE_METHODS,
    TRANSPORT_CONDITIONS,
    CertificateConditions,
    certify,
)
from defmanip_gym.theory.certificates.peak_bounds import resonant_limit
from defmanip_gym.theory.payload.zero_dynamics import linearize

SIGMA = math.pi / 6
DESIGN, PLANT = BeamParams(damping=1.0), BeamParams(damping=0.1)


def test_reference_beam_gives_the_papers_nu_max():
    certificate = certify(DESIGN, method="tanner")
    assert round(certificate.nu_max, 7) == 1.0890e-3
    assert certificate.is_proven
    assert certificate.acceleration_bound == certificate.speed_bound == certificate.nu_max / 2


def test_printed_radical_gives_another_number_and_proves_nothing():
    certificate = certify(DESIGN, method="tanner_printed")
    assert certificate.nu_max == pytest.approx(2.7e-2, rel=0.01)
    assert not certificate.is_proven


@pytest.mark.parametrize(
    ("beam", "method", "bound"),
    [
        (DESIGN, "tanner", 1.089e-3),
        (PLANT, "tanner", 1.11e-4),
        (DESIGN, "lyapunov", 4.36e-3),
        (PLANT, "lyapunov", 4.4e-4),
        (DESIGN, "ellipsoid", 1.91),
        (PLANT, "ellipsoid", 0.196),
        (DESIGN, "l1", 2.127),
        (PLANT, "l1", 0.218),
    ],
)
def test_ladder_of_bounds(beam, method, bound):
    assert certify(beam, method=method).nu_max == pytest.approx(bound, rel=0.01)


@given(st.floats(0.02, 0.97), st.floats(0.2, 2.0), st.floats(0.1, 1.0))
def test_l1_has_its_closed_form_for_one_hinge(zeta, length, sigma):
    omega = math.sqrt(1.5 * 9.81 / length)
    inertia = 2.0 * length**2 / 3
    beam = BeamParams(mass_kg=2.0, length_m=length, damping=2 * zeta * omega * inertia)
    exact = sigma * 9.81 * math.tanh(math.pi * zeta / (2 * math.sqrt(1 - zeta**2)))
    assert certify(beam, sigma_rad=sigma).nu_max == pytest.approx(exact, rel=3e-4)


def test_corrected_radical_is_what_equation_21_implies():
    linear, nu_max = linearize(DESIGN), certify(DESIGN, method="tanner").nu_max
    P = np.linalg.eigvalsh(_lyapunov(linear.A_u))
    gain = 4 * math.sqrt(2) * P[-1] * math.sqrt(P[-1] / P[0])  # Eq. (21), n − m = 1
    # ‖B_u ν‖ ≤ λ_M(B_u) √2 ν_max, Eq. (18)'s count of ν's components
    reached = gain * np.linalg.norm(linear.B_u, 2) * math.sqrt(2) * nu_max
    assert reached == pytest.approx(SIGMA)


def _lyapunov(A):
    size = len(A)
    operator = np.kron(A.T, np.eye(size)) + np.kron(np.eye(size), A.T)
    return np.linalg.solve(operator, -np.eye(size).ravel()).reshape(size, size)


@pytest.mark.parametrize(
    "condition",
    [
        "vertical_acceleration_m_s2",
        "yaw_rate_rad_s",
        "initial_swing_rad",
        "acceleration_error_m_s2",
    ],
)
def test_every_condition_costs_some_of_the_l1_bound(condition):
    free = certify(PLANT).acceleration_bound
    value = getattr(TRANSPORT_CONDITIONS, condition)
    restricted = certify(PLANT, conditions=CertificateConditions(**{condition: value}))
    assert 0 < restricted.acceleration_bound < free
    twice = certify(PLANT, conditions=CertificateConditions(**{condition: 2 * value}))
    assert twice.acceleration_bound < restricted.acceleration_bound


def test_initial_swing_costs_the_tanner_bound():
    conditions = CertificateConditions(initial_swing_rad=0.01)
    assert (
        certify(DESIGN, method="tanner", conditions=conditions).nu_max
        < certify(DESIGN, method="tanner").nu_max
    )


@pytest.mark.parametrize("method", CERTIFICATE_METHODS)
def test_no_certificate_holds_at_a_yaw_rate_that_overturns_the_beam(method):
    # hanging is unstable beyond u2² (J − I∥) > m g l/2: 4.95 rad/s for the reference beam
    with pytest.raises(CertificateError):
        certify(DESIGN, method=method, conditions=CertificateConditions(yaw_rate_rad_s=6.0))


@pytest.mark.parametrize("segments", [1, 2, 5])
@pytest.mark.parametrize("method", CERTIFICATE_METHODS)
def test_undamped_object_is_refused(method, segments):
    beam = BeamParams(damping=0.0, joint_damping=0.0, segment_count=segments)
    with pytest.raises(CertificateError, match="damping"):
        certify(beam, method=method)


def test_conditions_that_leave_no_room_are_refused():
    with pytest.raises(CertificateError, match="ask for less"):
        certify(PLANT, conditions=CertificateConditions(initial_swing_rad=0.6))


@pytest.mark.parametrize("sigma", [0.0, -1.0, math.pi / 2, float("nan")])
def test_sigma_beyond_the_linearization_is_refused(sigma):
    with pytest.raises(ParameterError, match="sigma"):
        certify(PLANT, sigma_rad=sigma)


def test_unknown_method_is_refused_with_the_known_ones():
    with pytest.raises(CertificateError, match="l1"):
        certify(PLANT, method="magic")


def test_negative_conditions_are_refused():
    with pytest.raises(ParameterError, match="yaw_rate"):
        CertificateConditions(yaw_rate_rad_s=-0.1)


@given(st.floats(0.05, 3.0), st.floats(1.05, 3.0))
def test_more_damping_never_lowers_the_bound(damping, factor):
    weak = certify(BeamParams(damping=damping)).nu_max
    strong = certify(BeamParams(damping=factor * damping)).nu_max
    assert strong >= weak * (1 - 1e-5)


@pytest.mark.parametrize("segments", [2, 3])
def test_worst_input_of_the_linear_model_attains_sigma(segments):
    beam = BeamParams(damping=0.3, segment_count=segments, joint_stiffness=3.0)
    bound, linear = certify(beam).nu_max, linearize(beam)
    period, steps = 0.004, 15_000
    held = np.vstack((np.c_[linear.A_u, linear.forward_input], np.zeros(2 * segments + 1)))
    step = expm(period * held)
    # response of every angle to the input held over one sample, k samples ago
    state, responses = step[:-1, -1], np.empty((steps, segments))
    for k in range(steps):
        responses[k], state = state[:segments], step[:-1, :-1] @ state
    reached = bound * np.abs(responses).sum(axis=0)  # the input sign(response) read backwards
    assert 0.98 * SIGMA < reached.max() < 1.001 * SIGMA


@pytest.mark.parametrize(("damping", "limit"), [(1.0, 2.204), (0.1, 0.225)])
def test_phase_plane_is_the_true_limit_of_one_hinge(damping, limit):
    certificate = certify(BeamParams(damping=damping), method="phase_plane")
    assert certificate.nu_max == pytest.approx(limit, rel=0.002)
    assert certificate.proof == "nonlinear"


def test_phase_plane_leaves_more_room_for_lifting_and_turning_than_small_gain():
    exact, small_gain = (
        certify(PLANT, method=method, conditions=TRANSPORT_CONDITIONS).nu_max
        for method in ("phase_plane", "l1")
    )
    assert exact > 1.25 * small_gain


def test_phase_plane_is_refused_for_more_than_one_hinge():
    with pytest.raises(CertificateError, match="one hinge"):
        certify(BeamParams(segment_count=2), method="phase_plane")


def test_rungs_are_in_the_order_of_their_bounds():
    beam = BeamParams(damping=0.4, segment_count=4, joint_stiffness=5.0)
    ladder = ("tanner", "lyapunov", "ellipsoid", "l1")
    bounds = [certify(beam, method=method).nu_max for method in ladder]
    assert bounds == sorted(bounds)
    assert bounds[-1] <= resonant_limit(linearize(beam), SIGMA)


@settings(max_examples=15)
@given(st.floats(0.01, 5.0), st.floats(0.1, 5.0), st.integers(1, 3), st.floats(0.0, 30.0))
def test_tanner_covers_the_lifting_that_its_nu_counts(damping, mass, segments, stiffness):
    beam = BeamParams(
        mass_kg=mass,
        damping=damping,
        segment_count=segments,
        joint_stiffness=stiffness,
        joint_damping=damping / 5,
    )
    tanner = certify(beam, method="tanner")
    lifted = CertificateConditions(
        vertical_acceleration_m_s2=tanner.conditions.vertical_acceleration_m_s2
    )
    assert certify(beam, conditions=lifted).nu_max >= tanner.acceleration_bound


@pytest.mark.parametrize("name", ["conditions", "intervals"])
@pytest.mark.parametrize("value", ["narrow", {}, 0, (0.5, 2.0)])
def test_conditions_and_intervals_of_another_kind_are_refused(name, value):
    with pytest.raises(ParameterError, match=name):
        certify(PLANT, **{name: value})


def test_conditions_that_nothing_is_carried_under_are_refused():
    with pytest.raises(ParameterError, match="yaw_rate"):
        CertificateConditions(yaw_rate_rad_s=1e160)


def test_objects_damped_next_to_nothing_are_refused_at_once():
    with pytest.raises(CertificateError, match="damping ratios"):
        certify(BeamParams(damping=1e-6))


def test_a_certificate_can_be_lowered_but_not_raised():
    certificate = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)
    half = certificate.lowered(certificate.acceleration_bound / 2)
    assert half.acceleration_bound == certificate.acceleration_bound / 2
    assert half.nu_max == pytest.approx(half.resulting_acceleration)
    assert half.proof == "nonlinear" and half.conditions == certificate.conditions
    for bound in (0.0, math.nan, 1.01 * certificate.acceleration_bound):
        with pytest.raises(ParameterError, match="acceleration_bound_m_s2"):
            certificate.lowered(bound)


def test_what_is_proven_for_the_nonlinear_object_is_a_certificate_of_its_own():
    beam = BeamParams(segment_count=2, damping=1.0, joint_damping=1.0)
    linear = certify(beam)
    proven = linear.proven()
    assert (linear.proof, proven.proof) == ("linear", "nonlinear")
    assert proven.acceleration_bound == linear.nonlinear_limit
    assert proven.proven() is proven
    with pytest.raises(CertificateError, match="nonlinear_limit"):
        certify(linearize(beam)).proven()
    with pytest.raises(CertificateError, match="nonlinear_limit"):
        certify(beam, method="tanner_printed").proven()


@pytest.mark.parametrize("sigma", [Fraction(1, 3), np.array(0.4), np.float32(0.4)])
@pytest.mark.parametrize("method", ["tanner", "l1", "phase_plane"])
def test_any_real_number_is_a_sigma(sigma, method):
    certificate = certify(BeamParams(), sigma_rad=sigma, method=method)
    assert certificate == certify(BeamParams(), sigma_rad=float(sigma), method=method)
