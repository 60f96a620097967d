"""Points move along a field within their limits, and streamlines end at the goal."""

import numpy as np

from defmanip_gym.theory.control.moving_reference import MovingReference, streamline
from defmanip_gym.theory.control.velocity_field import NormalizedField

PERIOD = 0.02
FIELD = NormalizedField(
    max_speed_m_s=1.9,
    deceleration_m_s2=1.5,
    vertical_deceleration_m_s2=1.0,
    approach_rate_per_s=3.0,
)
STARTS = np.array([[-8.5, 5.5, -0.4], [-4.0, -3.0, 0.2], [-0.5, 0.0, 0.0]])


def test_a_point_from_rest_reaches_the_goal_within_its_limits():
    point = MovingReference.at(STARTS, np.zeros_like(STARTS))
    for _ in range(600):
        point = point.steered(FIELD, 2.0, PERIOD)
        assert np.hypot(*point.acceleration[:, :2].T).max() <= 2.0 + 1e-9
        assert np.abs(point.acceleration[:, 2]).max() <= 2.0
        point = point.moved(PERIOD)
        assert np.hypot(*point.velocity[:, :2].T).max() <= 1.9 + 1e-9
    assert np.abs(point.position).max() < 1e-3
    assert np.abs(point.velocity).max() < 1e-3


def test_its_samples_are_those_of_a_constant_acceleration():
    point = MovingReference.at(STARTS, np.ones_like(STARTS)).steered(FIELD, 2.0, PERIOD)
    whole, halves = point.moved(PERIOD), point.moved(PERIOD / 2).moved(PERIOD / 2)
    np.testing.assert_allclose(whole.position, halves.position, atol=1e-15)
    np.testing.assert_allclose(whole.velocity, halves.velocity, atol=1e-15)


def test_streamlines_are_followed_to_the_goal():
    times = np.array([0.02, 0.5, 2.0, 12.0])
    coarse, velocities = streamline(FIELD, STARTS, times, 0.1)
    fine, _ = streamline(FIELD, STARTS, times, 0.01)
    assert np.abs(coarse - fine).max() < 0.02
    np.testing.assert_allclose(velocities, FIELD.velocity(coarse))
    assert np.abs(coarse[:, -1]).max() < 1e-3
