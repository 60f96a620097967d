"""A velocity field whose streamlines all reach the goal along +x, by short ways.

Derivation: docs/derivations.md, section 22.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.theory.control.ways import Way, way_to_goal
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_positive, settle

# Forwards and in reverse: a way in reverse is one forwards in a mirror at the y axis.
_GEARS = np.array([1.0, -1.0])
# What a turn to a way's course counts for against the way itself, as a share of its time.
_TURN_SHARE = 0.7


@dataclass(frozen=True, kw_only=True)
class OrientedField:
    """The field travelled at a speed that leaves room to turn and to stop, by grasp or robot.

    For a grasp alone it is the streamline's velocity. A robot that says its heading is led with its
    axle, the point ``reach_m`` behind the grasp, along the streamlines, forwards or in reverse, and
    turns on the spot where it must: so it arrives with the goal's heading from any start.

    Attributes:
        reach_m: ρ* of the arm at the goal.
        max_speed_m_s: of the grasp.
        deceleration_m_s2: with which it brakes.
        vertical_deceleration_m_s2: likewise, of the height, which is brought in on its own.
        approach_rate_per_s: speed per distance in the end, into which braking goes over smoothly.
        lateral_acceleration_m_s2: largest v²/r along arcs.
        yaw_rate_rad_s: largest |u2|; turning pulls the grasp towards the axle by ρ u2², which
            swings the object as braking does.
        turn_radius_m: R.
        turn_rate_per_s: yaw rate per heading error.
        look_ahead_s: how far ahead on its way the robot looks for its course.
        straightening_radius_m: of the axle, within which arcs shrink, as it can turn on the spot.
        settling_radius_m: of the axle, within which ways give way to turning and driving at once.
    """

    reach_m: float
    max_speed_m_s: float
    deceleration_m_s2: float
    vertical_deceleration_m_s2: float
    approach_rate_per_s: float
    lateral_acceleration_m_s2: float
    yaw_rate_rad_s: float
    turn_radius_m: float = 1.5
    turn_rate_per_s: float = 3.0
    look_ahead_s: float = 0.2
    straightening_radius_m: float = 0.5
    settling_radius_m: float = 0.155

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            settle(self, name, require_positive)

    def velocity(self, p: Array, heading: Array | None = None) -> Array:
        """Return the field at p, for a robot with ``heading`` (...) rad if it is given."""
        height = p[..., 2]
        up = -np.sign(height) * self._braking(np.abs(height), self.vertical_deceleration_m_s2)
        if heading is None:
            way = way_to_goal(p[..., 0], p[..., 1], self.turn_radius_m)
            course, forward, left = way.course, self._speed(way), np.zeros_like(height)
        else:
            course = heading
            forward, yaw_rate = self._axle_motion(p, heading)
            left = self.reach_m * yaw_rate
        cos, sin = np.cos(course), np.sin(course)
        return np.stack((forward * cos - left * sin, forward * sin + left * cos, up), axis=-1)

    def _axle_motion(self, p: Array, heading: Array) -> tuple[Array, Array]:
        """Return u1 and u2 of a robot, (...) each."""
        x = p[..., 0] - self.reach_m * (np.cos(heading) - 1.0)
        y = p[..., 1] - self.reach_m * np.sin(heading)
        speed, yaw_rate = self._following(x, y, heading)
        # at the goal courses mean nothing any more: drive and turn to it at once
        near_speed = -np.sign(x) * self._braking(np.abs(x), self.deceleration_m_s2)
        near_rate = -self.approach_rate_per_s * (_wrapped(heading) + y / self.reach_m)
        square = (x**2 + y**2) / self.settling_radius_m**2
        share = square**4 / (1.0 + square**4)
        limit = min(self.yaw_rate_rad_s, self.max_speed_m_s / self.reach_m)
        speed = share * speed + (1.0 - share) * near_speed * np.cos(heading)
        yaw_rate = share * yaw_rate + (1.0 - share) * np.clip(near_rate, -limit, limit)
        left = self.reach_m * yaw_rate
        fastest = np.sqrt(np.maximum(self.max_speed_m_s**2 - left**2, 0.0))
        return np.clip(speed, -fastest, fastest), yaw_rate

    def _following(self, x: Array, y: Array, heading: Array) -> tuple[Array, Array]:
        """Return u1 and u2 towards the better of the two ways, forwards and in reverse."""
        gear = _GEARS.reshape(2, *np.ones(x.ndim, dtype=int))
        near = (x**2 + y**2) / self.straightening_radius_m**2
        radius = self.turn_radius_m * np.minimum(1.0, near)
        way = way_to_goal(gear * x, y, radius)
        speed, course = self._speed(way), gear * way.course
        error = _wrapped(course - heading)
        limit = min(self.yaw_rate_rad_s, self.max_speed_m_s / self.reach_m)
        arc = way.arc_rad * np.maximum(1.0 / limit, way.radius_m / self.max_speed_m_s)
        time = way.straight_m / self.max_speed_m_s + arc + _TURN_SHARE * np.abs(error) / limit
        ahead = self.look_ahead_s * gear * speed
        there = way_to_goal(gear * (x + ahead * np.cos(course)), y + ahead * np.sin(course), radius)
        turn = self.turn_rate_per_s * _wrapped(gear * there.course - heading)
        speed = gear * speed * np.maximum(np.cos(error), 0.0)
        turn = np.clip(turn, -limit, limit)
        forwards = time[0] <= time[1]
        return np.where(forwards, speed[0], speed[1]), np.where(forwards, turn[0], turn[1])

    def _speed(self, way: Way) -> Array:
        """Return the speed from which there is room to brake, before the arc and to the goal."""
        turning = np.minimum(
            np.sqrt(self.lateral_acceleration_m_s2 * way.radius_m),
            self.yaw_rate_rad_s * way.radius_m,
        )
        before = np.sqrt(turning**2 + 2 * self.deceleration_m_s2 * way.straight_m)
        length = way.straight_m + way.radius_m * way.arc_rad
        return np.minimum(before, self._braking(length, self.deceleration_m_s2))

    def _braking(self, distance: Array, deceleration: float) -> Array:
        """Return √(2 a s − (a/k)²), and k s from a/k² on, where both have the same slope."""
        rate = self.approach_rate_per_s
        linear = deceleration / rate**2
        braking = np.sqrt(deceleration * np.maximum(2 * distance - linear, linear))
        approach = np.where(distance < linear, rate * distance, braking)
        return np.minimum(self.max_speed_m_s, approach)


def _wrapped(angle: Array) -> Array:
    """Return the angle in [−π, π]."""
    return np.arctan2(np.sin(angle), np.cos(angle))
