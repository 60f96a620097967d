"""Which commands the robot will carry out as they are: speed limiter, actuators, the arm's range.

Whatever changes a command after a filter has allowed it may undo what the filter meant by it. So a
filter chooses among those that are left alone: a ball, |v + T w| at most the speed limit, and a
box.
"""

from __future__ import annotations

from math import cos, sqrt
from typing import NamedTuple

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.dynamics.redundancy import ReachRule
from defmanip_gym.theory.dynamics.robot_model import ArmLengths

# of the drive force that is counted on
_DRIVE_SHARE = 0.9
# of the largest acceleration, for stopping before the arm's limits
BRAKING_SHARE = 0.6


class RobotLimits(NamedTuple):
    """What a filter knows of the robot (compiled code takes named tuples).

    Attributes:
        arm: its geometry.
        rule: of the reach.
        max_acceleration_m_s2: of a command, on each axis.
        max_speed_m_s: of the grasp.
        period_s: the control period.
        drive_force_n: of the base.
        base_mass_kg: without arm and object.
        total_mass_kg: with them.
        least_bend_rad: how far the elbow is kept from straight, and from folded.
        lowest_m: grasp height.
    """

    arm: ArmLengths
    rule: ReachRule
    max_acceleration_m_s2: float
    max_speed_m_s: float
    period_s: float
    drive_force_n: float
    base_mass_kg: float
    total_mass_kg: float
    least_bend_rad: float
    lowest_m: float


@compilable
def forward_range(limits: RobotLimits, reach: float, yaw_rate: float) -> tuple[float, float]:
    """Return the forward accelerations that the drive has the force for, m/s²."""
    force = _DRIVE_SHARE * limits.drive_force_n
    turning = limits.base_mass_kg * reach * yaw_rate**2
    low, high = (-force - turning) / limits.total_mass_kg, (force - turning) / limits.total_mass_kg
    largest = limits.max_acceleration_m_s2
    return min(max(low, -largest), 0.0), max(min(high, largest), 0.0)


@compilable
def height_range(limits: RobotLimits, reach: float, above: float) -> tuple[float, float]:
    """Return the lowest and highest grasp above the shoulder, m, at a reach.

    The folded arm leaves a gap around the shoulder's height; ``above`` tells the side.
    """
    upper, fore = limits.arm.upper_arm_m, limits.arm.forearm_m
    both, bent = upper**2 + fore**2, 2.0 * upper * fore * cos(limits.least_bend_rad)
    highest = sqrt(max(both + bent - reach**2, 0.0))
    gap = sqrt(max(both - bent - reach**2, 0.0))
    lowest = -highest
    if gap > 0.0 and above > 0.0:
        lowest = gap
    elif gap > 0.0:
        highest = -gap
    return max(lowest, limits.lowest_m - limits.arm.shoulder_height_m), highest


@compilable
def upward_range(
    limits: RobotLimits, reach: float, height: float, upward_m_s: float
) -> tuple[float, float]:
    """Return the vertical accelerations after which the grasp can still stop within the arm."""
    largest, period_s = limits.max_acceleration_m_s2, limits.period_s
    above = height - limits.arm.shoulder_height_m
    lowest, highest = height_range(limits, reach, above)
    later = above + period_s * upward_m_s
    twice = 2.0 * BRAKING_SHARE * largest
    rising, sinking = (
        sqrt(twice * max(highest - later, 0.0)),
        sqrt(twice * max(later - lowest, 0.0)),
    )
    low, high = (-sinking - upward_m_s) / period_s, (rising - upward_m_s) / period_s
    return min(max(low, -largest), largest), max(min(high, largest), -largest)


@compilable
def farthest_share(
    limits: RobotLimits,
    start: tuple[float, float, float],
    end: tuple[float, float, float],
    velocity: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> float:
    """Return how far one can go from one command to another within box and speed limit, in [0, 1].

    Args:
        limits: of the robot.
        start: a command that is allowed, m/s².
        end: the one that is wanted.
        velocity: of the grasp, m/s.
        low: lower corner of the box, m/s².
        high: its upper one.
    """
    share, a, b, c, own = 1.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        change = end[i] - start[i]
        if change > 0.0 and end[i] > high[i]:
            share = min(share, max(high[i] - start[i], 0.0) / change)
        if change < 0.0 and end[i] < low[i]:
            share = min(share, max(start[i] - low[i], 0.0) / -change)
        first, step = velocity[i] + limits.period_s * start[i], limits.period_s * change
        a, b, c = a + step**2, b + first * step, c + first**2
        own += velocity[i] ** 2
    c -= max(limits.max_speed_m_s**2, max(own, c))
    if a > 0.0 and a + 2.0 * b + c > 0.0:
        share = min(share, (sqrt(max(b**2 - a * c, 0.0)) - b) / a)
    return max(share, 0.0)


@compilable
def braking(
    limits: RobotLimits, velocity: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return the command that slows the grasp down along its path, m/s²; deep within the ball."""
    fastest = max(abs(velocity[0]), abs(velocity[1]), abs(velocity[2]))
    rate = min(limits.max_acceleration_m_s2 / max(fastest, 1e-9), 1.0 / limits.period_s)
    return -rate * velocity[0], -rate * velocity[1], -rate * velocity[2]
