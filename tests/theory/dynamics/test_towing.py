"""A towed base turns as its differential equation says."""

import numpy as np
import pytest

from defmanip_gym.theory.dynamics.towing import towed_heading

REACH = 0.7


@pytest.mark.parametrize("course", [0.0, 1.0, 3.0, -2.0])
def test_a_towed_heading_solves_its_differential_equation(course):
    velocity, heading = 1.5 * np.array([[np.cos(course), np.sin(course)]]), np.array([0.4])
    integrated = heading.copy()
    for _ in range(2000):
        left = velocity[:, 1] * np.cos(integrated) - velocity[:, 0] * np.sin(integrated)
        integrated += 0.8 / 2000 * left / REACH
    found = towed_heading(heading, velocity, np.array([REACH]), 0.8)
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * integrated), atol=1e-3)


def test_a_base_whose_grasp_stands_still_keeps_its_heading():
    heading = np.array([0.4, -3.0])
    found = towed_heading(heading, np.zeros((2, 2)), np.full(2, REACH), 1.0)
    np.testing.assert_allclose(found, heading)
