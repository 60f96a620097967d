"""The storage of objects of links, in any direction: what ``storage`` is for rods.

Where z2 swings out of the vertical plane of the heading, turning couples to it by m_y, and

    B = V + ½ u2² (I_σ − I_z) + μ |u2|,    μ ≥ |m_yᵀ ż2| wherever V ≤ V_σ,
    Ḃ = −ż2ᵀ d_o22 ż2 − sᵀ z̈1 + u̇2 (u2 (I_σ − I_z) + μ sign u2 − m_yᵀ ż2),

so that B does not rise while the grasp does not accelerate and |u2| does not grow.
Derivation: docs/derivations.md, section 18.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compilable
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.theory.dynamics.chain import Array, solve_positive_definite
from defmanip_gym.theory.payload.linkage import Linkage, LinkageRoom, cross, place
from defmanip_gym.theory.payload.linkage_motion import MotionRoom, along_joint, push, weigh


class LinkageModel(NamedTuple):
    """What B of an object depends on (compiled code takes named tuples).

    Attributes:
        linkage: the object.
        lowest: its potential at the equilibrium, J.
        yaw_inertia: I_σ, the largest inertia about the vertical within σ, (1,) kg·m².
        yaw_momentum: μ, (1,) kg·m²/s.
        mass: of all that is carried, (1,) kg.
        passes: V_σ, (1,) J.
        reversing: |u1 + 2ρ̇| |u2| that a robot may have while reversing, (1,) m/s².
    """

    linkage: Linkage
    lowest: Array
    yaw_inertia: Array
    yaw_momentum: Array
    mass: Array
    passes: Array
    reversing: Array


class LinkageStorageRoom(NamedTuple):
    """Where one state of an object is stepped; the first four as in ``StorageRoom``."""

    swing: Array  # z2 at the end of the step, (N,)
    swing_rate: Array
    middle: Array
    rate: Array
    matrix: Array  # (N, N)
    links: LinkageRoom
    motion: MotionRoom

    @classmethod
    def empty(cls, count: int) -> LinkageStorageRoom:
        """Return room for N links."""
        return cls(
            swing=np.zeros(count),
            swing_rate=np.zeros(count),
            middle=np.zeros(count),
            rate=np.zeros(count),
            matrix=np.zeros((count, count)),
            links=LinkageRoom.empty(count),
            motion=MotionRoom.empty(count),
        )


@compilable
def linkage_step(
    model: LinkageModel,
    c: int,
    swing: Array,
    swing_rate: Array,
    grasp: tuple[float, float, float],
    yaw_rate: float,
    yaw_acceleration: float,
    period_s: float,
    room: LinkageStorageRoom,
) -> None:
    """Write z2 and ż2 after a period of constant acceleration into ``room``.

    The midpoint rule, implicit in springs, as ``swing_step``; without dampers: V counts on none.

    Args:
        model: of the object.
        c: 0.
        swing: z2, (N,).
        swing_rate: ż2, (N,).
        grasp: its acceleration forward, left and up, m/s².
        yaw_rate: u2 in the middle, rad/s.
        yaw_acceleration: u̇2, rad/s².
        period_s: of the step.
        room: the result; what :func:`linkage_power` needs is left there.
    """
    linkage, motion, half = model.linkage, room.motion, 0.5 * period_s
    count = len(swing)
    for j in range(count):
        room.middle[j] = swing[j] + half * swing_rate[j]
    place(linkage, room.middle, room.links)
    weigh(linkage, room.links, motion)
    push(linkage, room.links, swing_rate, grasp, yaw_rate, yaw_acceleration, motion)
    for j in range(count):
        torque = along_joint(linkage, j, room.links, motion.force[j], motion.torque[j])
        torque -= linkage.preload[j]
        momentum = 0.0
        for k in range(count):
            torque += linkage.stiffness[j, k] * swing[k]
            momentum += motion.M[j, k] * swing_rate[k]
            room.matrix[j, k] = motion.M[j, k] + half**2 * linkage.stiffness[j, k]
        room.rate[j] = momentum - half * torque
    solve_positive_definite(room.matrix, room.rate, 0)
    for j in range(count):
        room.swing[j] = swing[j] + period_s * room.rate[j]
        room.swing_rate[j] = 2 * room.rate[j] - swing_rate[j]


@compilable
def linkage_storage(
    model: LinkageModel,
    c: int,
    swing: Array,
    swing_rate: Array,
    yaw_rate: float,
    room: LinkageStorageRoom,
) -> float:
    """Return B of one state, J; arguments as of ``storage_at``."""
    linkage, links = model.linkage, room.links
    place(linkage, swing, links)
    stored = _kinetic(linkage, links, swing_rate, room.motion) - model.lowest[0]
    for i in range(len(swing)):
        stored += GRAVITY_M_S2 * linkage.mass[i] * links.center[i, 2]
        stored -= linkage.preload[i] * swing[i]
        for k in range(len(swing)):
            stored += 0.5 * linkage.stiffness[i, k] * swing[i] * swing[k]
    stored += 0.5 * yaw_rate**2 * (model.yaw_inertia[0] - yaw_inertia(linkage, links))
    return stored + model.yaw_momentum[0] * abs(yaw_rate)


@compilable
def linkage_power(
    model: LinkageModel, c: int, yaw_rate: float, reach: float, room: LinkageStorageRoom
) -> tuple[float, float, float]:
    """Return −∂Ḃ/∂w forward, left, upward in the middle of the step in ``room``, kg·m/s.

    A leftward acceleration turns the base: u̇2 = (w_l − …)/ρ.
    """
    forward = left = upward = coupled = 0.0
    for j in range(len(room.rate)):
        momentum = room.motion.momentum[j]
        forward += momentum[0] * room.rate[j]
        left += momentum[1] * room.rate[j]
        upward += momentum[2] * room.rate[j]
        coupled += room.motion.spin[j, 2] * room.rate[j]
    turning = yaw_rate * (model.yaw_inertia[0] - yaw_inertia(model.linkage, room.links)) - coupled
    if yaw_rate > 0.0:
        turning += model.yaw_momentum[0]
    if yaw_rate < 0.0:
        turning -= model.yaw_momentum[0]
    return forward, left - turning / reach, upward


@compilable
def linkage_reversing(
    model: LinkageModel, ahead: float, yaw_rate: float, reach: float, period_s: float
) -> tuple[float, float, float]:
    """Return the least acceleration forward, and the range to the side, m/s², while reversing.

    A robot that reverses jackknifes: to hold its yaw rate it has to accelerate to the side by
    |u1 + 2ρ̇| |u2|, which feeds what swings there, so only little of that is let happen.

    Args:
        model: of the object.
        ahead: u1 + 2ρ̇, m/s.
        yaw_rate: u2, rad/s.
        reach: ρ, m.
        period_s: for which accelerations hold.
    """
    free, turning = model.reversing[0], abs(yaw_rate)
    if free == np.inf:
        return -np.inf, -np.inf, np.inf
    back = min((-free / max(turning, 1e-9) - ahead) / period_s, 0.0)
    holding, largest = ahead * yaw_rate, free / max(-ahead, 1e-9)
    low = min(reach * (-largest - yaw_rate) / period_s, 0.0)
    high = max(reach * (largest - yaw_rate) / period_s, 0.0)
    return back, holding + low, holding + high


@compilable
def yaw_inertia(linkage: Linkage, links: LinkageRoom) -> float:
    """Return I_z of placed links about the vertical through the grasp, kg·m²."""
    total = 0.0
    for i in range(len(linkage.mass)):
        center = links.center[i]
        total += links.inertia[i, 2, 2] + linkage.mass[i] * (center[0] ** 2 + center[1] ** 2)
    return total


@compilable
def _kinetic(linkage: Linkage, links: LinkageRoom, rate: Array, room: MotionRoom) -> float:
    """Return ½ ż2ᵀ m_o22 ż2 of placed links, J."""
    energy, turning, moving = 0.0, room.turning, room.moving
    r = room.spare[0]
    for i in range(len(rate)):
        parent, axis = linkage.parent[i], links.axis[i]
        for k in range(3):
            turning[i, k] = moving[i, k] = 0.0
            if parent >= 0:
                turning[i, k], moving[i, k] = turning[parent, k], moving[parent, k]
                r[k] = links.origin[i, k] - links.origin[parent, k]
            else:
                r[k] = 0.0
        for k in range(3):
            moving[i, k] += cross(turning[i], r, k)
        for k in range(3):
            if linkage.slides[i] != 0:
                moving[i, k] += axis[k] * rate[i]
            else:
                turning[i, k] += axis[k] * rate[i]
        for k in range(3):
            r[k] = links.center[i, k] - links.origin[i, k]
        for k in range(3):
            velocity = moving[i, k] + cross(turning[i], r, k)
            energy += 0.5 * linkage.mass[i] * velocity**2
            for m in range(3):
                energy += 0.5 * turning[i, k] * links.inertia[i, k, m] * turning[i, m]
        energy += 0.5 * linkage.armature[i] * rate[i] ** 2
    return energy
