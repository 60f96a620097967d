"""How long it takes to the goal: an estimate that tells a good decision at once from a bad one.

The grasp travels a way of :mod:`defmanip_gym.theory.control.ways`, forwards or in reverse, as fast
as a double integrator that stops at its end, and turns to the way's course as one, too.
Derivation: docs/derivations.md, section 25.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.control.ways import way_to_goal
from defmanip_gym.theory.dynamics.frames import wrapped

_STRAIGHTENING_M = 0.5  # of the axle, within which arcs shrink: it can turn on the spot
_SETTLING_M = 0.2  # of the axle, within which the goal's heading counts instead of a way's course


class Mover(NamedTuple):
    """What a robot can do, for the estimate.

    Attributes:
        acceleration_m_s2: with which the grasp speeds up and brakes.
        speed_m_s: largest, of the grasp.
        turn_radius_m: R of the ways.
        turn_rate_rad_s: on the spot, in the mean.
        yaw_rate_rad_s: largest.
        reach_m: ρ* of the arm at the goal.
        turn_share: what a turn that is yet to be made counts for.
        vertical_share: likewise the height, which is brought in meanwhile.
    """

    acceleration_m_s2: float
    speed_m_s: float
    turn_radius_m: float
    turn_rate_rad_s: float
    yaw_rate_rad_s: float
    reach_m: float
    turn_share: float
    vertical_share: float


class Motion(NamedTuple):
    """Of the grasp, in axes at the goal with x along the goal's heading.

    Attributes:
        x_m: position.
        y_m: to the left.
        z_m: up.
        heading_rad: θ − θ_goal in (−π, π].
        forward_m_s: along the robot's heading.
        up_m_s: velocity.
        yaw_rate_rad_s: u2.
    """

    x_m: float
    y_m: float
    z_m: float
    heading_rad: float
    forward_m_s: float
    up_m_s: float
    yaw_rate_rad_s: float


@compilable
def stopping_time(distance: float, closing: float, acceleration: float, fastest: float) -> float:
    """Return the least time in which a double integrator comes to rest at a distance, s.

    Args:
        distance: to go, not negative.
        closing: velocity towards the end; it may be away from it.
        acceleration: largest, either way.
        fastest: largest |velocity|; a higher one is taken for this one.
    """
    closing = min(max(closing, -fastest), fastest)
    braking = closing**2 / (2 * acceleration)
    if closing > 0 and braking > distance:  # overshoots and comes back
        return closing / acceleration + 2 * math.sqrt((braking - distance) / acceleration)
    peak = math.sqrt(acceleration * distance + closing**2 / 2)
    if peak <= fastest:
        return (2 * peak - closing) / acceleration
    cruise = distance - (2 * fastest**2 - closing**2) / (2 * acceleration)
    return (2 * fastest - closing) / acceleration + cruise / fastest


@compilable
def time_to_go(motion: Motion, mover: Mover) -> float:
    """Return about how long a robot takes to the goal, s; 0 at rest there."""
    heading = motion.heading_rad
    x = motion.x_m - mover.reach_m * (math.cos(heading) - 1.0)
    y = motion.y_m - mover.reach_m * math.sin(heading)
    square = x**2 + y**2
    radius = mover.turn_radius_m * min(1.0, square / _STRAIGHTENING_M**2)
    share = square**2 / (square**2 + _SETTLING_M**4)
    slowest_turn = min(mover.turn_rate_rad_s, mover.speed_m_s / mover.reach_m)
    least = math.inf
    for gear in (1.0, -1.0):
        way = way_to_goal(gear * x, y, radius)
        length = way.straight_m + way.radius_m * way.arc_rad
        error = share * wrapped(gear * way.course - heading) - (1.0 - share) * heading
        towards = motion.yaw_rate_rad_s if error > 0 else -motion.yaw_rate_rad_s
        turn = stopping_time(
            abs(error),
            towards,
            mover.acceleration_m_s2 / mover.reach_m,
            mover.yaw_rate_rad_s,
        )
        travel = stopping_time(
            length,
            gear * motion.forward_m_s * math.cos(error),
            mover.acceleration_m_s2,
            mover.speed_m_s,
        )
        # along an arc too small for its speed, turning takes the time
        arc = max(1.0 / slowest_turn - way.radius_m / mover.speed_m_s, 0.0) * way.arc_rad
        least = min(least, travel + share * arc + mover.turn_share * turn)
    sinking = -motion.up_m_s if motion.z_m > 0 else motion.up_m_s
    height = stopping_time(abs(motion.z_m), sinking, mover.acceleration_m_s2, mover.speed_m_s)
    return least + mover.vertical_share * height
