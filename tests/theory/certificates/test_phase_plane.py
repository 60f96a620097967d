"""The set that inputs within a bound can reach."""

from dataclasses import replace

import numpy as np
import pytest
from nonlinear_beam import largest_swing, one_hinge_acceleration

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import (
    EXACT_PARAMETERS,
    TRANSPORT_CONDITIONS,
    CertificateConditions,
    certify,
)
from defmanip_gym.theory.certificates.phase_plane import one_hinge_reachable_set

SIGMA = np.pi / 6


def reachable(beam, acceleration, conditions=TRANSPORT_CONDITIONS):
    return one_hinge_reachable_set(beam, acceleration, SIGMA, conditions, EXACT_PARAMETERS)


def test_the_reachable_set_of_the_exact_limit_ends_at_sigma():
    certificate = certify(BeamParams(), method="phase_plane", conditions=TRANSPORT_CONDITIONS)
    angles, rates = reachable(BeamParams(), certificate.resulting_acceleration)
    assert angles[[0, -1]] == pytest.approx([-SIGMA, SIGMA], rel=1e-3)
    assert (rates >= 0).all() and rates[[0, -1]] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("damping", [0.1, 1.0])
def test_bang_bang_inputs_come_close_to_the_edge_but_not_beyond(damping):
    beam, bound = replace(BeamParams(), damping=damping), 0.15
    angles, _ = reachable(beam, bound, CertificateConditions())

    def outward(_, phi, rate):
        return -bound * np.sign(np.where(rate == 0, 1.0, rate)), 0.0, 0.0

    peak = largest_swing(
        one_hinge_acceleration(beam), outward, np.zeros(1), duration_s=90.0, period_s=0.005
    )
    assert 0.98 * angles[-1] < peak[0] <= angles[-1] * 1.001


def test_beyond_the_limit_nothing_is_enclosed():
    assert reachable(BeamParams(), 1.0) is None
