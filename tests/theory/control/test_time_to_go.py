import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.theory.control.time_to_go import Motion, Mover, stopping_time, time_to_go

MOVER = Mover(
    acceleration_m_s2=2.0,
    speed_m_s=2.0,
    turn_radius_m=2.6,
    turn_rate_rad_s=1.1,
    yaw_rate_rad_s=2.0,
    reach_m=0.7,
    turn_share=0.7,
    vertical_share=1.0,
)
AT_REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
PERIOD_S = 1e-3


def rest_to_rest(distance, closing, acceleration, fastest):
    """Simulate the switching law of the time-optimal double integrator until it rests, s."""
    steps = 0
    while abs(distance) + abs(closing) > 0.01:
        excess = distance - closing * abs(closing) / (2 * acceleration)
        command = math.copysign(acceleration, excess)
        if command * closing > 0 and abs(closing) >= fastest:
            command = 0.0
        closing += command * PERIOD_S
        distance -= closing * PERIOD_S
        steps += 1
    return steps * PERIOD_S


@pytest.mark.parametrize("closing", [-1.5, 0.0, 1.0, 2.0])
@pytest.mark.parametrize("distance", [0.2, 1.0, 6.0])
def test_stopping_takes_what_the_switching_law_takes(distance, closing):
    expected = rest_to_rest(distance, closing, 2.0, 2.0)
    assert stopping_time(distance, closing, 2.0, 2.0) == pytest.approx(expected, abs=0.1)


@given(st.floats(0, 20), st.floats(-3, 3))
def test_stopping_time_is_positive_and_grows_with_the_distance(distance, closing):
    time = stopping_time(distance, closing, 2.0, 2.0)
    assert time >= 0
    if closing <= 0:
        assert stopping_time(distance + 0.1, closing, 2.0, 2.0) > time


def test_at_rest_in_the_goal_no_time_is_left():
    assert time_to_go(AT_REST, MOVER) == 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"x_m": -0.1},
        {"y_m": 0.1},
        {"z_m": -0.1},
        {"heading_rad": 0.2},
        {"forward_m_s": 0.2},
        {"up_m_s": 0.2},
        {"yaw_rate_rad_s": 0.3},
    ],
)
def test_whatever_is_not_as_in_the_goal_takes_time(change):
    assert time_to_go(AT_REST._replace(**change), MOVER) > 0.05


def test_straight_ahead_it_is_the_double_integrators_time():
    before = AT_REST._replace(x_m=-6.0, forward_m_s=1.0)
    assert time_to_go(before, MOVER) == pytest.approx(stopping_time(6.0, 1.0, 2.0, 2.0))


def test_behind_the_goal_it_backs_up():
    behind = AT_REST._replace(x_m=2.0)
    assert time_to_go(behind, MOVER) == pytest.approx(stopping_time(2.0, 0.0, 2.0, 2.0))
    backing = behind._replace(forward_m_s=-1.0)
    assert time_to_go(backing, MOVER) < time_to_go(behind, MOVER)


def test_left_and_right_are_alike():
    rng = np.random.default_rng(0)
    for _ in range(50):
        x, y, z, heading, forward, up, yaw = rng.normal(size=7).tolist()
        there = time_to_go(Motion(x, y, z, heading, forward, up, yaw), MOVER)
        mirrored = time_to_go(Motion(x, -y, z, -heading, forward, up, -yaw), MOVER)
        assert mirrored == pytest.approx(there)
