"""Short ways to the goal that all end along +x: straight on, then along an arc.

The dipole of Section VI looks the same at every scale: from far away it leads in wide circles, and
from x > 0 it leads in along −x. Here a way goes straight to one of the two circles of radius R that
touch the x axis at the goal, and along it to the goal; within a circle the dipole's own, smaller
circles go on. L. E. Dubins, "On curves of minimal length with a constraint on average curvature",
American Journal of Mathematics 79 (1957), has such ways as the shortest ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array

_TINY = 1e-12


class Way(NamedTuple):
    """From points to the goal: straight on, then along an arc that ends along +x; (...) each.

    Attributes:
        course: direction at the point, rad.
        straight_m: length of the straight part.
        arc_rad: how far the arc turns.
        radius_m: of the arc.
    """

    course: Array
    straight_m: Array
    arc_rad: Array
    radius_m: Array


def way_to_goal(x: Array, y: Array, turn_radius_m: Array | float) -> Way:
    """Return the way from each point, over the circle on its own side of the x axis.

    Continuous but for the half line y = 0, x > 0, from which it leads away on both sides.

    Args:
        x: relative to the goal, (...) m.
        y: likewise.
        turn_radius_m: R, (...).
    """
    side, y = np.where(y < 0, -1.0, 1.0), np.abs(y)
    square = x**2 + y**2
    power = square - 2 * turn_radius_m * y  # of the point with respect to the circle
    radius = np.where(power < 0, square / np.maximum(2 * y, _TINY), turn_radius_m)
    straight = np.sqrt(np.maximum(power, 0.0))
    # towards the circle's centre, and from there to its tangent
    course = np.arctan2(radius - y, -x) - np.arctan2(radius, straight)
    arc = np.where((course > 0) & (x > 0), 2 * np.pi - course, np.maximum(-course, 0.0))
    return Way(side * course, straight, arc, radius)
