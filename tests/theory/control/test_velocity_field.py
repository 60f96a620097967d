import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.control.velocity_field import (
    LiteralField,
    NormalizedField,
    dipole_direction,
    potential,
    potential_gradient,
    streamline_heading,
)

FIELD = NormalizedField(max_speed_m_s=1.0, deceleration_m_s2=0.1, vertical_deceleration_m_s2=0.02)
positions = arrays(float, (3,), elements=st.floats(-9, 9)).filter(
    lambda p: np.hypot(p[0], p[1]) > 0.05 and abs(p[0]) > 0.01
)


@given(positions)
def test_gradient_is_the_slope_of_the_potential(p):
    step = 1e-6
    slope = [(potential(p + step * e) - potential(p - step * e)) / (2 * step) for e in np.eye(3)]
    np.testing.assert_allclose(potential_gradient(p), slope, atol=1e-5 * max(1, *np.abs(slope)))


@given(positions)
def test_direction_is_the_normalized_descent_of_the_potential(p):
    descent = -potential_gradient(p)[:2]
    np.testing.assert_allclose(dipole_direction(p), descent / np.linalg.norm(descent), atol=1e-9)


def test_potential_has_its_least_value_at_the_goal():
    points = np.random.default_rng(0).uniform(-5, 5, (500, 3))
    assert (potential(points) > potential(np.zeros(3))).all()


def follow(direction, starts, *, step_m, steps):
    """Return the path (steps, n, 2) along unit directions, shortened near the origin."""
    p, path = np.array(starts), []
    for _ in range(steps):
        away = np.linalg.norm(p, axis=1, keepdims=True)
        p = p + np.minimum(step_m, 0.02 * away) * direction(p)
        path.append(p.copy())
    return np.stack(path)


def random_starts(count):
    rng = np.random.default_rng(1)
    return np.stack((rng.uniform(-9, -0.5, count), rng.uniform(-8, 8, count)), axis=1)


def test_streamlines_from_behind_reach_the_goal_along_forward():
    path = follow(
        lambda p: dipole_direction(np.pad(p, ((0, 0), (0, 1)))),
        random_starts(40),
        step_m=0.05,
        steps=4000,
    )
    last = path[-1]
    np.testing.assert_allclose(np.linalg.norm(last, axis=1), 0.0, atol=1e-3)
    # as they come within 1 cm they have to come from -x
    near = np.linalg.norm(path, axis=2) < 0.01
    first = near.argmax(axis=0)
    arrival = path[first, np.arange(path.shape[1])]
    assert (arrival[:, 0] < 0).all()
    assert (np.abs(arrival[:, 1]) < 0.1 * np.abs(arrival[:, 0])).all()


def test_printed_potential_has_radial_streamlines_instead():
    # with p_z² under the root, as printed, the planar descent points at the goal from anywhere
    def printed(p):
        s = p[0] ** 2 + p[1] ** 2
        return s / np.sqrt(s**2 + p[2] ** 2) + p[2] ** 2

    rng, step = np.random.default_rng(2), 1e-6
    for p in np.column_stack((rng.uniform(-5, 5, (20, 2)), rng.uniform(0.2, 1, 20))):
        descent = -np.array(
            [(printed(p + step * e) - printed(p - step * e)) / (2 * step) for e in np.eye(3)]
        )[:2]
        across = descent[0] * p[1] - descent[1] * p[0]
        assert abs(across) < 1e-4 * np.linalg.norm(descent) * np.linalg.norm(p[:2]) + 1e-9


@given(positions)
def test_streamline_heading_is_tangent_to_the_streamline(p):
    heading = streamline_heading(p[..., 0], p[..., 1])
    along = dipole_direction(p) @ [np.cos(heading), np.sin(heading)]
    assert along == pytest.approx(1.0 if p[0] < 0 else -1.0, abs=1e-9)


def test_literal_field_crawls_far_away():
    far, near = np.array([-9.0, 5.0, 0.0]), np.array([-0.5, 0.0, 0.0])
    literal = LiteralField(k=1.0)
    assert np.linalg.norm(literal.velocity(far)) < 2e-3
    assert np.linalg.norm(literal.velocity(near)) > 0.3
    assert np.linalg.norm(FIELD.velocity(far)) == pytest.approx(1.0)


@given(positions)
def test_speed_profile_never_asks_for_more_than_its_deceleration(p):
    distance = np.hypot(p[0], p[1])
    speed = np.linalg.norm(FIELD.velocity(p)[:2])
    assert speed <= min(1.0, np.sqrt(2 * 0.1 * distance), 0.8 * distance) + 1e-12
    assert speed > 0
    assert FIELD.velocity(p)[2] * p[2] <= 0


def test_field_is_finite_and_still_at_the_goal():
    np.testing.assert_allclose(FIELD.velocity(np.zeros((4, 3))), 0.0)
    np.testing.assert_allclose(LiteralField().velocity(np.zeros(3)), 0.0)
    np.testing.assert_allclose(dipole_direction(np.zeros(3)), [1.0, 0.0])


def test_bad_speeds_are_refused():
    with pytest.raises(ParameterError, match="max_speed"):
        NormalizedField(max_speed_m_s=0, deceleration_m_s2=1, vertical_deceleration_m_s2=1)
    with pytest.raises(ParameterError):
        LiteralField(k=-1)
