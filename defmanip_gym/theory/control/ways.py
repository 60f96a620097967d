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

from defmanip_gym.compiled import Numbers, compilable

_TINY = 1e-12


class Way(NamedTuple):
    """From points to the goal: straight on, then along an arc that ends along +x; (...) each.

    Attributes:
        course: direction at the point, rad.
        straight_m: length of the straight part.
        arc_rad: how far the arc turns.
        radius_m: of the arc.
    """

    course: Numbers
    straight_m: Numbers
    arc_rad: Numbers
    radius_m: Numbers


@compilable
def way_to_goal(x: Numbers, y: Numbers, turn_radius_m: Numbers) -> Way:
    """Return the way from each point, over the circle on its own side of the x axis.

    Continuous but for the half line y = 0, x > 0, from which it leads away on both sides.

    Args:
        x: relative to the goal, (...) m.
        y: likewise.
        turn_radius_m: R, (...).
    """
    # choices as products: np.where takes arrays only
    side, y = 1.0 - 2.0 * (y < 0), np.abs(y)
    square = x**2 + y**2
    power = square - 2 * turn_radius_m * y  # of the point with respect to the circle
    within = 1.0 * (power < 0)
    radius = within * (square / np.maximum(2 * y, _TINY)) + (1.0 - within) * turn_radius_m
    straight = np.sqrt(np.maximum(power, 0.0))
    # towards the circle's centre, and from there to its tangent
    course = np.arctan2(radius - y, -x) - np.arctan2(radius, straight)
    around = 1.0 * ((course > 0) & (x > 0))
    arc = around * (2 * np.pi - course) + (1.0 - around) * np.maximum(-course, 0.0)
    return Way(side * course, straight, arc, radius)
