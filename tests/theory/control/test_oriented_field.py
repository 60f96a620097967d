import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.control.oriented_field import OrientedField
from defmanip_gym.theory.control.ways import way_to_goal

REACH_M = 0.7
FIELD = OrientedField(
    reach_m=REACH_M,
    max_speed_m_s=2.0,
    deceleration_m_s2=1.5,
    vertical_deceleration_m_s2=1.0,
    approach_rate_per_s=6.0,
    lateral_acceleration_m_s2=2.0,
    yaw_rate_rad_s=1.2,
)
RADIUS_M = FIELD.turn_radius_m
coordinates, angles = st.floats(-18, 18), st.floats(-np.pi, np.pi)


def around(count, *, seed=0, nearest_m=0.5):
    """Return positions 0.5 to 18 m away in all directions, (n, 3), and headings."""
    rng = np.random.default_rng(seed)
    distance, bearing = rng.uniform(nearest_m, 18, count), rng.uniform(-np.pi, np.pi, count)
    p = np.stack((distance * np.cos(bearing), distance * np.sin(bearing), 0 * bearing), axis=1)
    return p, rng.uniform(-np.pi, np.pi, count)


def test_all_streamlines_arrive_along_forward():
    p, _ = around(300)
    arrived = np.zeros(len(p), dtype=bool)
    for _ in range(3000):
        velocity = FIELD.velocity(p)
        entering = ~arrived & (np.hypot(p[:, 0], p[:, 1]) < 0.02)
        course = np.arctan2(velocity[entering, 1], velocity[entering, 0])
        np.testing.assert_allclose(course, 0.0, atol=0.1)
        assert (p[entering, 0] < 0).all()
        arrived |= entering
        p = p + 0.01 * velocity
    assert arrived.all()


def test_a_unicycle_arrives_with_the_goals_heading_from_anywhere():
    p, heading = around(300, seed=1)
    for _ in range(3000):
        velocity = FIELD.velocity(p, heading)
        left = velocity[:, 1] * np.cos(heading) - velocity[:, 0] * np.sin(heading)
        p, heading = p + 0.01 * velocity, heading + 0.01 * left / REACH_M
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 0.0, atol=0.02)
    np.testing.assert_allclose(np.sin(heading / 2), 0.0, atol=0.1)


@given(coordinates, coordinates)
def test_a_way_is_a_straight_line_and_an_arc_to_the_goal_along_forward(x, y):
    way = way_to_goal(np.array(x), np.array(y), RADIUS_M)
    tangent = np.array([x, y]) + way.straight_m * np.array([np.cos(way.course), np.sin(way.course)])
    centre = np.array([0.0, way.radius_m if y >= 0 else -way.radius_m])
    spoke = tangent - centre
    scale = 1 + np.hypot(x, y)
    assert np.hypot(*spoke) == pytest.approx(float(way.radius_m), abs=1e-5 * scale)
    # the arc turns the spoke until it points from the centre to the goal
    turn = way.arc_rad if y >= 0 else -way.arc_rad
    turned = [
        np.cos(turn) * spoke[0] - np.sin(turn) * spoke[1],
        np.sin(turn) * spoke[0] + np.cos(turn) * spoke[1],
    ]
    np.testing.assert_allclose(centre + turned, 0.0, atol=1e-5 * scale)


@given(st.floats(0.0, 18.0), angles)
def test_a_way_is_as_long_as_the_straight_line_or_longer(distance, bearing):
    x, y = distance * np.cos(bearing), distance * np.sin(bearing)
    way = way_to_goal(np.array(x), np.array(y), RADIUS_M)
    length = way.straight_m + way.arc_rad * way.radius_m
    assert distance - 1e-6 <= length <= distance + 2 * np.pi * RADIUS_M + 1e-6


def test_far_ways_are_nearly_straight_where_the_dipole_goes_in_circles():
    way = way_to_goal(np.array(-8.0), np.array(6.0), RADIUS_M)
    assert way.straight_m + way.arc_rad * way.radius_m < 1.03 * 10.0
    # the dipole's circle through the point: radius 25/3 m, 73.7 degrees
    assert 2 * np.arctan2(6.0, 8.0) * 100 / 12 > 1.07 * 10.0


def test_courses_are_continuous_but_ahead_of_the_goal():
    p, _ = around(2000, seed=2, nearest_m=0.05)
    p = p[(p[:, 0] < -0.02) | (np.abs(p[:, 1]) > 0.02)]
    step = 1e-6 * np.stack((np.cos(p[:, 0] * 9), np.sin(p[:, 0] * 9), np.zeros(len(p))), axis=1)
    change = np.linalg.norm(FIELD.velocity(p + step) - FIELD.velocity(p), axis=1)
    assert change.max() < 5e-3


@given(coordinates, coordinates, angles)
def test_speed_and_yaw_rate_stay_within_their_limits(x, y, heading):
    p = np.array([x, y, 0.0])
    velocity = FIELD.velocity(p, np.array(heading))
    assert np.hypot(*velocity[:2]) <= FIELD.max_speed_m_s + 1e-9
    left = velocity[1] * np.cos(heading) - velocity[0] * np.sin(heading)
    assert abs(left) <= REACH_M * FIELD.yaw_rate_rad_s + 1e-9


@given(coordinates, coordinates)
def test_there_is_room_to_turn_and_to_stop(x, y):
    way = way_to_goal(np.array(x), np.array(y), RADIUS_M)
    speed = np.hypot(*FIELD.velocity(np.array([x, y, 0.0]))[:2])
    length = way.straight_m + way.arc_rad * way.radius_m
    assert speed**2 <= 2 * FIELD.deceleration_m_s2 * length + 1e-9
    assert speed <= FIELD.approach_rate_per_s * length + 1e-9
    on_arc = np.sqrt(max(speed**2 - 2 * FIELD.deceleration_m_s2 * way.straight_m, 0.0))
    assert on_arc <= FIELD.yaw_rate_rad_s * way.radius_m + 1e-9
    assert on_arc**2 <= FIELD.lateral_acceleration_m_s2 * way.radius_m + 1e-9


def test_a_robot_ahead_of_the_goal_that_faces_forward_backs_up_to_it():
    assert FIELD.velocity(np.array([6.0, 0.2, 0.0]), np.array(0.0))[0] < -1.5


def test_the_field_rests_at_the_goal():
    origin = np.zeros((2, 3))
    np.testing.assert_allclose(FIELD.velocity(origin), 0.0, atol=1e-12)
    np.testing.assert_allclose(FIELD.velocity(origin, np.zeros(2)), 0.0, atol=1e-12)


def test_limits_that_make_no_field_are_refused():
    with pytest.raises(ParameterError, match="turn_radius_m"):
        OrientedField(**{**vars(FIELD), "turn_radius_m": 0.0})
