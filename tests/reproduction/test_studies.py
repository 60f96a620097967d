"""Wrong damping in the force law, and the transport under l1."""

import numpy as np
import pytest

from defmanip_gym.reproduction.studies import damping_study, effective_damping, l1_transport


@pytest.fixture(scope="module")
def cases():
    part = damping_study(6.0)
    return {case["assumed_damping"]: case for case in part.numbers["cases"]}


def test_only_the_design_damping_in_the_force_law_makes_the_swing_grow(cases):
    assert cases[1.0]["measured_growth_per_s"] > 0.5
    assert cases[1.0]["duration_s"] < 6.0  # it left σ
    for assumed in (0.1, 0.0):
        assert cases[assumed]["measured_growth_per_s"] < -0.05
        assert cases[assumed]["largest_swing_rad"] == pytest.approx(0.02, rel=0.01)


def test_growth_is_what_the_sampled_loop_predicts(cases):
    for case in cases.values():
        predicted = case["predicted_growth_per_s"]
        assert case["measured_growth_per_s"] == pytest.approx(predicted, rel=0.15)
        assert np.sign(-case["effective_damping"]) == np.sign(predicted)
        assert (case["spectral_radius"] > 1) == (predicted > 0)


def test_effective_damping_of_the_papers_case():
    assert effective_damping(0.1, 1.0) == pytest.approx(-2.6)
    assert effective_damping(0.1, 0.0) == pytest.approx(0.4)


def test_l1_stops_when_time_is_up_and_keeps_sigma():
    part = l1_transport(2.0)
    assert part.numbers["outcome"] == "timeout"
    assert part.numbers["duration_s"] == pytest.approx(2.0)
    assert part.numbers["largest_swing_rad"] < np.pi / 6
