"""Swing from noisy sensors: estimates and how far off they may be."""

import numpy as np
import pytest

from defmanip_gym.theory.filters.swing_estimate import SwingEstimate

PERIOD_S, NOISE_RAD, FREQUENCY = 0.02, 0.02, 5.0


def errors(drift_rad, count=400, periods=200, seed=0):
    """Return the estimates' errors and bounds, (periods, n), of a beam that swings freely."""
    rng = np.random.default_rng(seed)
    estimate = SwingEstimate(count, 1, noise_rad=NOISE_RAD, drift_rad=drift_rad, period_s=PERIOD_S)
    phases = rng.uniform(0, 2 * np.pi, (count, 1))
    found = []
    for k in range(periods):
        angle = FREQUENCY * k * PERIOD_S + phases
        swing, rate = 0.5 * np.cos(angle), -0.5 * FREQUENCY * np.sin(angle)
        measured = swing + NOISE_RAD * rng.normal(size=swing.shape)
        if k == 0:
            estimate.begin(measured, rate, np.ones(count, dtype=bool))
        else:
            estimate.update(measured, rate)
        found.append((np.abs(estimate.mean - swing)[:, 0], estimate.uncertainty[:, 0]))
    return np.array(found)


def test_the_truth_is_never_farther_than_told():
    found = errors(drift_rad=PERIOD_S**3 / 12 * FREQUENCY**3 * 0.5)
    assert (found[:, 0] <= found[:, 1]).all()


def test_within_a_second_it_is_known_better_than_measured():
    found = errors(drift_rad=1e-5)
    assert found[50:, 0].std() < 0.2 * NOISE_RAD
    assert found[50:, 1].max() < 1.1 * NOISE_RAD


def test_starts_of_some_leave_the_others_alone():
    estimate = SwingEstimate(2, 1, noise_rad=0.1, drift_rad=0.0, period_s=PERIOD_S)
    both = np.ones(2, dtype=bool)
    estimate.begin(np.array([[0.1], [0.2]]), np.zeros((2, 1)), both)
    estimate.update(np.array([[0.1], [0.2]]), np.zeros((2, 1)))
    before = estimate.uncertainty[1, 0]
    estimate.begin(np.array([[0.3], [9.0]]), np.zeros((2, 1)), np.array([True, False]))
    assert estimate.mean[:, 0] == pytest.approx([0.3, 0.2])
    assert estimate.uncertainty[1, 0] == before < estimate.uncertainty[0, 0]
