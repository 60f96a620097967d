"""How objects of links move: Eq. (6) by recursion, with the yawing grasp's motion as input.

M q̈ + Q(z2, ż2, z̈1, u2, u̇2) + K z2 − k = 0 without dampers, M of (z̈1, u̇2, z̈2) by composite bodies,
Q by Newton and Euler (both as in any textbook on rigid bodies).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compilable
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.linkage import Linkage, LinkageRoom, cross


class MotionRoom(NamedTuple):
    """Room for the motion of one state.

    Attributes:
        mass: of a link and what hangs on it, (N,) kg.
        moment: its first moment about the grasp, (N, 3) kg·m.
        second: its inertia about the grasp, (N, 3, 3) kg·m².
        momentum: m_o12's columns: what a joint's unit rate moves, (N, 3).
        spin: the same about the grasp, (N, 3), of which the last is what couples to u̇2.
        M: m_o22, (N, N).
        turning: ω of the links, (N, 3) rad/s.
        turning_dot: ω̇ at z̈2 = 0, (N, 3) rad/s².
        moving: acceleration, or velocity, of the frames' origins, (N, 3).
        force: on a link and what hangs on it, (N, 3) N.
        torque: about the grasp, (N, 3) N·m.
        spare: (6, 3).
    """

    mass: Array
    moment: Array
    second: Array
    momentum: Array
    spin: Array
    M: Array
    turning: Array
    turning_dot: Array
    moving: Array
    force: Array
    torque: Array
    spare: Array

    @classmethod
    def empty(cls, count: int) -> MotionRoom:
        """Return room for N links."""
        vectors, square = (count, 3), (count, count)
        shapes = ((count,), vectors, (count, 3, 3), vectors, vectors, square, *(vectors,) * 5)
        return cls(*(np.zeros(shape) for shape in (*shapes, (6, 3))))


@compilable
def weigh(linkage: Linkage, links: LinkageRoom, room: MotionRoom) -> None:
    """Write m_o22 and, for each joint, m_o12 and the coupling to the yaw, of placed links."""
    count = len(linkage.mass)
    for i in range(count):
        mass, c = linkage.mass[i], links.center[i]
        square = c[0] ** 2 + c[1] ** 2 + c[2] ** 2
        room.mass[i] = mass
        for k in range(3):
            room.moment[i, k] = mass * c[k]
            for m in range(3):
                room.second[i, k, m] = links.inertia[i, k, m] - mass * c[k] * c[m]
            room.second[i, k, k] += mass * square
    for i in range(count - 1, -1, -1):
        parent = linkage.parent[i]
        if parent < 0:
            continue
        room.mass[parent] += room.mass[i]
        for k in range(3):
            room.moment[parent, k] += room.moment[i, k]
            for m in range(3):
                room.second[parent, k, m] += room.second[i, k, m]
    for i in range(count):
        _weigh_joint(linkage, i, links, room)
        j = i
        while j >= 0:
            room.M[j, i] = room.M[i, j] = along_joint(
                linkage, j, links, room.momentum[i], room.spin[i]
            )
            j = linkage.parent[j]
        room.M[i, i] += linkage.armature[i]


@compilable
def _weigh_joint(linkage: Linkage, i: int, links: LinkageRoom, room: MotionRoom) -> None:
    """Write the momenta of unit rate of joint i; clear its row of M."""
    for j in range(i):
        room.M[i, j] = room.M[j, i] = 0.0
    axis, moment, P, L = links.axis[i], room.moment[i], room.momentum[i], room.spin[i]
    if linkage.slides[i] != 0:
        for k in range(3):
            P[k], L[k] = room.mass[i] * axis[k], cross(moment, axis, k)
        return
    # a point at x moves with axis × (x − origin) = axis × x + shift
    shift = room.spare[0]
    for k in range(3):
        shift[k] = -cross(axis, links.origin[i], k)
    for k in range(3):
        P[k] = cross(axis, moment, k) + room.mass[i] * shift[k]
        L[k] = cross(moment, shift, k)
        for m in range(3):
            L[k] += room.second[i, k, m] * axis[m]


@compilable
def along_joint(linkage: Linkage, j: int, links: LinkageRoom, force: Array, torque: Array) -> float:
    """Return what of a force, and a torque about the grasp, acts along joint j."""
    axis, origin, total = links.axis[j], links.origin[j], 0.0
    for k in range(3):
        if linkage.slides[j] != 0:
            total += axis[k] * force[k]
        else:
            total += axis[k] * (torque[k] - cross(origin, force, k))
    return total


@compilable
def push(
    linkage: Linkage,
    links: LinkageRoom,
    rate: Array,
    grasp: tuple[float, float, float],
    yaw_rate: float,
    yaw_acceleration: float,
    room: MotionRoom,
) -> None:
    """Write forces and torques that the placed links need for z̈2 = 0, gravity included.

    Args:
        linkage: the object.
        links: where it is.
        rate: ż2, (N,).
        grasp: its acceleration, m/s².
        yaw_rate: u2, rad/s.
        yaw_acceleration: u̇2, rad/s².
        room: ``force`` and ``torque`` are the result.
    """
    spin, spin_dot, a, spare = room.turning, room.turning_dot, room.moving, room.spare
    r, inner, f = spare[3], spare[4], spare[5]
    for i in range(len(linkage.mass)):
        parent, axis = linkage.parent[i], links.axis[i]
        for k in range(3):
            spare[0, k] = spare[1, k] = 0.0
            spare[2, k] = grasp[k]
            r[k] = links.origin[i, k]
        if parent < 0:
            spare[0, 2], spare[1, 2] = yaw_rate, yaw_acceleration
            spare[2, 2] += GRAVITY_M_S2
        else:
            for k in range(3):
                spare[0, k], spare[1, k], spare[2, k] = (
                    spin[parent, k],
                    spin_dot[parent, k],
                    a[parent, k],
                )
                r[k] -= links.origin[parent, k]
        for k in range(3):
            inner[k] = cross(spare[0], r, k)
        for k in range(3):
            spin[i, k], spin_dot[i, k] = spare[0, k], spare[1, k]
            a[i, k] = spare[2, k] + cross(spare[1], r, k) + cross(spare[0], inner, k)
            if linkage.slides[i] != 0:
                a[i, k] += 2.0 * cross(spare[0], axis, k) * rate[i]
            else:
                spin[i, k] += axis[k] * rate[i]
                spin_dot[i, k] += cross(spare[0], axis, k) * rate[i]
        for k in range(3):
            r[k] = links.center[i, k] - links.origin[i, k]
        for k in range(3):
            inner[k] = cross(spin[i], r, k)
        for k in range(3):
            f[k] = linkage.mass[i] * (a[i, k] + cross(spin_dot[i], r, k) + cross(spin[i], inner, k))
        for k in range(3):
            inner[k] = r[k] = 0.0
            for m in range(3):
                inner[k] += links.inertia[i, k, m] * spin[i, m]
                r[k] += links.inertia[i, k, m] * spin_dot[i, m]
        for k in range(3):
            room.force[i, k] = f[k]
            room.torque[i, k] = r[k] + cross(spin[i], inner, k) + cross(links.center[i], f, k)
    for i in range(len(linkage.mass) - 1, -1, -1):
        parent = linkage.parent[i]
        for k in range(3 if parent >= 0 else 0):
            room.force[parent, k] += room.force[i, k]
            room.torque[parent, k] += room.torque[i, k]
