"""What is proven for nonlinear beams, against their simulation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nonlinear_beam import chain_acceleration, largest_swing, one_hinge_acceleration

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import CertificateConditions, ParameterIntervals, certify
from defmanip_gym.theory.certificates.conditions import EXACT_PARAMETERS
from defmanip_gym.theory.certificates.limits import linear_limit
from defmanip_gym.theory.certificates.nonlinear_margin import _off_centre, nonlinear_limit_in_box
from defmanip_gym.theory.payload.zero_dynamics import linearize

SIGMA = math.pi / 6
NOTHING = CertificateConditions()


def limit(beam, sigma=SIGMA, conditions=NOTHING, box=EXACT_PARAMETERS):
    return nonlinear_limit_in_box(beam, sigma, conditions, box)


@pytest.mark.parametrize("damping", [0.05, 0.3, 1.0])
def test_the_worst_input_breaks_a_one_hinge_limit_raised_by_one_percent_only(damping):
    beam = BeamParams(damping=damping, root_stiffness=2.0)
    bounds = limit(beam) * np.array([0.999, 1.01])

    def pumping(_, phi, rate):
        return -bounds * np.sign(rate + 1e-12), 0.0, 0.0

    spring = one_hinge_acceleration(beam)
    inertia = beam.mass_kg * beam.length_m**2 / 3

    def acceleration(phi, *rest):
        return spring(phi, *rest) - beam.root_stiffness * phi / inertia

    peak = largest_swing(acceleration, pumping, np.zeros(2), duration_s=100.0, period_s=0.002)
    assert peak[0] <= SIGMA < peak[1]


def test_an_overdamped_hinge_is_held_at_sigma_by_a_constant_acceleration():
    assert limit(BeamParams(damping=20.0)) == pytest.approx(9.81 * math.tan(SIGMA), rel=1e-3)


@given(st.floats(0.05, 3.0), st.floats(0.05, 1.0), st.floats(0.0, 0.5))
def test_l1_stays_below_the_exact_limit_of_one_hinge(damping, sigma, vertical):
    conditions = CertificateConditions(vertical_acceleration_m_s2=vertical * damping)
    beam = BeamParams(damping=damping)
    linear = linear_limit(linearize(beam), sigma, "l1", conditions, EXACT_PARAMETERS).bound
    # at small angles both are the same but for rounding
    assert linear <= 1.0001 * limit(beam, sigma, conditions)
    assert certify(beam, sigma_rad=sigma, conditions=conditions).proof == "nonlinear"


def test_lifting_turning_and_fast_starts_lower_the_limit():
    beam, free = BeamParams(), limit(BeamParams())
    for condition in (
        CertificateConditions(vertical_acceleration_m_s2=0.1),
        CertificateConditions(yaw_rate_rad_s=0.5),
        CertificateConditions(initial_swing_rate_rad_s=2.6),
        CertificateConditions(initial_swing_rad=0.5, initial_swing_rate_rad_s=0.78),
    ):
        assert limit(beam, conditions=condition) < free
    # the largest set that nothing leaves holds every state at rest within σ
    assert limit(beam, conditions=CertificateConditions(initial_swing_rad=0.5)) == free
    weak = ParameterIntervals(damping=(0.5, 1.0))
    assert limit(beam, box=weak) == pytest.approx(limit(BeamParams(damping=0.05)), rel=1e-6)


@pytest.mark.parametrize("segments", [2, 3])
def test_peaks_of_several_segments_are_never_exceeded(segments):
    beam = BeamParams(damping=1.0, segment_count=segments, joint_stiffness=5.0)
    proven = limit(beam)
    assert 0.01 * certify(beam).nu_max < proven < certify(beam).nu_max
    rng = np.random.default_rng(segments)
    offsets, dwell = rng.normal(scale=3.0, size=60), rng.integers(2, 60, 60)
    flips = np.ones(60)

    def pumping(t, phi, rate):
        again = round(t / 0.005) % dwell == 0
        flips[again] = rng.choice([-1.0, 1.0], again.sum())
        return -proven * flips * np.sign(rate[:, -1] + offsets * phi[:, -1] + 1e-12), 0.0, 0.0

    start = np.zeros((60, segments))
    peak = largest_swing(chain_acceleration(beam), pumping, start, duration_s=6.0, period_s=0.005)
    assert peak.max() <= SIGMA


@pytest.mark.parametrize(("segments", "share"), [(2, 0.8), (3, 0.7)])
def test_much_of_l1_is_proven_for_stiff_and_well_damped_beams(segments, share):
    beam = BeamParams(damping=1.0, segment_count=segments, joint_stiffness=20.0, joint_damping=0.5)
    assert share * certify(beam).nu_max < limit(beam) < certify(beam).nu_max


@pytest.mark.parametrize("share", [1.0, 0.977, 0.9])
def test_gravity_off_its_centre_is_never_underestimated(share):
    angles = np.linspace(0.0, 1.04, 500)
    exact = np.maximum.accumulate(np.abs(share * angles - np.sin(angles)))
    np.testing.assert_allclose(_off_centre(angles, share), exact, atol=1e-6)
    assert (_off_centre(angles, share) >= exact - 1e-15).all()


@pytest.mark.parametrize("method", ["tanner", "lyapunov"])
@pytest.mark.parametrize("segments", [1, 3])
def test_the_loose_rungs_hold_for_the_nonlinear_beam(method, segments):
    assert certify(BeamParams(segment_count=segments), method=method).proof == "nonlinear"


def test_a_certificate_does_not_claim_more_than_was_proven():
    tight = certify(BeamParams(damping=0.3, segment_count=3, joint_stiffness=3.0))
    assert tight.nonlinear_limit < tight.acceleration_bound
    assert tight.proof == "linear"
    assert certify(BeamParams(), method="tanner_printed").proof == "none"


def test_turning_costs_the_nonlinear_limit_more_than_its_linear_part():
    beam = BeamParams(damping=2.0, segment_count=2, joint_stiffness=5.0, joint_damping=1.0)
    turning = CertificateConditions(yaw_rate_rad_s=3.0)
    lost = 1 - limit(beam, conditions=turning) / limit(beam)
    linear = 1 - certify(beam, conditions=turning).nu_max / certify(beam).nu_max
    assert lost > linear
