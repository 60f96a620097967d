"""Certificates over intervals of damping and stiffness."""

import math

import numpy as np
import pytest

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import (
    CERTIFICATE_METHODS,
    TRANSPORT_CONDITIONS,
    ParameterIntervals,
    certify,
)
from defmanip_gym.theory.certificates.worst_case import BoxBound, worst_case

SIGMA = math.pi / 6
SPRUNG = BeamParams(damping=0.3, root_stiffness=4.0)
THREE = BeamParams(damping=0.5, segment_count=3, joint_stiffness=3.0, joint_damping=0.3)
WIDE = ParameterIntervals(damping=(0.6, 1.5), stiffness=(0.8, 1.2))


def scaled(beam, damping, stiffness):
    return BeamParams(
        damping=damping * beam.damping,
        joint_damping=damping * beam.joint_damping,
        root_stiffness=stiffness * beam.root_stiffness,
        joint_stiffness=stiffness * beam.joint_stiffness,
        segment_count=beam.segment_count,
    )


@pytest.mark.parametrize(
    ("beam", "method", "intervals"),
    [
        (SPRUNG, "lyapunov", WIDE),
        (SPRUNG, "ellipsoid", WIDE),
        (SPRUNG, "l1", WIDE),
        (SPRUNG, "phase_plane", WIDE),
        (THREE, "l1", ParameterIntervals(damping=(0.9, 1.1), stiffness=(0.95, 1.05))),
    ],
)
def test_bound_over_an_interval_holds_for_every_object_in_it(beam, method, intervals):
    over_all = certify(beam, method=method, intervals=intervals).nu_max
    low, high = np.transpose((intervals.damping, intervals.stiffness))
    inside = np.vstack((np.random.default_rng(0).uniform(low, high, (10, 2)), low, high))
    rung = "phase_plane" if method == "phase_plane" else "l1"
    exact = min(certify(scaled(beam, *factors), method=rung).nu_max for factors in inside)
    assert over_all <= exact
    if method == "l1":
        assert over_all > 0.85 * exact


def test_conditions_and_intervals_add_up():
    damping = ParameterIntervals(damping=(0.6, 1.5))
    both = certify(SPRUNG, intervals=damping, conditions=TRANSPORT_CONDITIONS).nu_max
    weakest = scaled(SPRUNG, 0.6, 1.0)
    assert 0.8 * both < both <= certify(weakest, conditions=TRANSPORT_CONDITIONS).nu_max
    assert both < certify(SPRUNG, intervals=damping).nu_max


def test_one_hinge_is_worst_at_its_weakest_damping():
    certificate = certify(BeamParams(), intervals=ParameterIntervals(damping=(0.5, 10.0)))
    weakest = certify(BeamParams(damping=0.05)).nu_max
    assert 0.94 * weakest < certificate.nu_max <= weakest
    assert certificate.worst_factors[0] == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("method", [m for m in CERTIFICATE_METHODS if m != "phase_plane"])
def test_an_interval_of_one_point_changes_nothing(method):
    point = ParameterIntervals(damping=(1.0, 1.0), stiffness=(1.0, 1.0))
    assert certify(THREE, method=method, intervals=point) == certify(THREE, method=method)


def test_a_dip_between_the_corners_is_found():
    # sampling the ends of the interval would see 1.0
    def bound(factor):
        return 1.0 - 0.9 * math.exp(-(((factor - 0.37) / 0.01) ** 2))

    def evaluate(box):
        low, high = box.damping
        steepest = 0.9 * math.sqrt(2 / math.e) / 0.01
        middle = (low + high) / 2
        return BoxBound(
            guaranteed=bound(middle) - steepest * (high - low) / 2,
            at_middle=bound(middle),
            damping_cost=1.0,
            stiffness_cost=0.0,
        )

    found = worst_case(ParameterIntervals(damping=(0.1, 1.0)), evaluate)
    assert 0.09 < found.bound <= 0.1
    assert found.damping == pytest.approx(0.37, abs=0.01)


def test_an_interval_that_reaches_zero_damping_is_refused():
    with pytest.raises(CertificateError, match="damping"):
        certify(BeamParams(), intervals=ParameterIntervals(damping=(0.0, 1.0)))


def test_lists_are_taken_as_intervals():
    listed = ParameterIntervals(damping=[0.8, 1.2], stiffness=[1.0, 1.0])
    assert listed == ParameterIntervals(damping=(0.8, 1.2))
    assert certify(BeamParams(), intervals=listed).proof == "nonlinear"


def test_a_wide_interval_of_a_spring_is_not_refused_for_its_nonlinear_limit():
    wide = ParameterIntervals(stiffness=(0.1, 2.0))
    certificate = certify(BeamParams(damping=3.0, root_stiffness=20.0), intervals=wide)
    weakest = certify(BeamParams(damping=3.0, root_stiffness=2.0)).nu_max
    assert 0.5 * weakest < certificate.nu_max <= weakest


@pytest.mark.parametrize("interval", [(2.0, 1.0), (-1.0, 1.0), (1.0,), (1.0, math.inf), "12"])
def test_intervals_that_are_none_are_refused(interval):
    with pytest.raises(ParameterError, match="damping"):
        ParameterIntervals(damping=interval)


def test_certificate_covers_the_beams_in_its_intervals_only():
    certificate = certify(THREE, method="tanner", intervals=WIDE)
    assert certificate.covers(scaled(THREE, 0.7, 1.1))
    assert not certificate.covers(scaled(THREE, 0.5, 1.0))
    assert not certificate.covers(scaled(THREE, 1.0, 1.3))
    assert not certificate.covers(BeamParams(segment_count=3))
    # more damping at a single hinge is safe, at one of several it is not known to be
    assert certify(BeamParams()).covers(BeamParams(damping=0.7))
    assert not certify(THREE).covers(scaled(THREE, 1.1, 1.0))
