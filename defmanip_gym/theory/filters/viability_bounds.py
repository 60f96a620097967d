"""What bounds the viable set of one hinge from outside and from within, compiled.

Both work with E = ½ φ̇² of a swing to the positive side, φ̇ > 0, and with the mirror image of what
they find on the other side. Why one half swing is enough: docs/derivations.md, section 20.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array, beam_links

_RATE_STEPS = 40  # at most, of the fixed point for the mean rate of a cell
_HALVINGS = 9  # of what may lie between storage's set and the outer bound
_PARTS = 4  # of the hardest braking, where a policy begins with it
_ROUNDING = 1e-9


class Hinge(NamedTuple):
    """One hinge on a grasp that is driven forward; compiled code takes named tuples.

    φ̈ = −pull (g sin φ + a cos φ) − damping φ̇ − stiffness φ.

    Attributes:
        pull: first moment over inertia, 1/m.
        damping: over inertia, 1/s.
        stiffness: over inertia, 1/s².
        sigma: σ, rad.
        acceleration: largest |a|, m/s².
        speed: largest |v|, m/s.
        period: for which a is held, s.
        substeps: of the integration, in a period.
    """

    pull: float
    damping: float
    stiffness: float
    sigma: float
    acceleration: float
    speed: float
    period: float
    substeps: int

    @classmethod
    def of(cls, beam: BeamParams, sigma_rad: float, task: TaskParams, substeps: int) -> Hinge:
        """Return the constants of a beam of one segment."""
        (rod,) = beam_links(beam)
        moment = rod.mass_kg * rod.com_m
        inertia = moment * rod.com_m + rod.transverse_inertia_kgm2
        return cls(
            pull=float(moment / inertia),
            damping=float(beam.damping / inertia),
            stiffness=float(beam.root_stiffness / inertia),
            sigma=float(sigma_rad),
            acceleration=float(task.max_acceleration_m_s2),
            speed=float(task.max_speed_m_s),
            period=float(task.control_period_s),
            substeps=substeps,
        )


@compilable
def potential(hinge: Hinge, phi: float) -> float:
    """Return U over the inertia, 1/s²."""
    return hinge.pull * GRAVITY_M_S2 * (1.0 - cos(phi)) + 0.5 * hinge.stiffness * phi**2


@compilable
def _read(row: Array, speed: float, largest: float) -> float:
    """Return what a table over equally spaced speeds says, linearly between its entries."""
    last = len(row) - 1
    place = min(max((speed + largest) / (2.0 * largest) * last, 0.0), float(last))
    cell = min(int(place), last - 1)
    rest = place - cell
    return (1.0 - rest) * row[cell] + rest * row[cell + 1]


@compilable
def _before(
    hinge: Hinge, phi: float, later: float, speed: float, push: float, after: Array
) -> float:
    """Return the largest E at φ from which E at the later φ is viable under one acceleration."""
    rise = potential(hinge, later) - potential(hinge, phi)
    lever = hinge.pull * (sin(later) - sin(phi)) / (later - phi)
    own = _read(after, speed, hinge.speed)
    energy = own + max(rise, 0.0)
    for _ in range(_RATE_STEPS):
        rate = 0.5 * (sqrt(2.0 * max(energy, 0.0)) + sqrt(2.0 * own))
        gained = push * (later - phi) / max(rate, 1e-12)
        gained = min(max(gained, -hinge.speed - speed), hinge.speed - speed)
        own = _read(after, speed + gained, hinge.speed)
        work = lever * gained * rate + hinge.damping * (later - phi) * rate
        found = own + rise + work
        change, energy = abs(found - energy), found
        if change <= _ROUNDING * energy:
            break
    return energy


@compiled
def outer_energy(hinge: Hinge, swing: Array, energy: Array) -> None:
    """Write the largest ½ φ̇² from which the swing can still be stopped at σ, by any a(t).

    φ takes the place of time, from σ backwards: a cell costs its work against gravity, spring,
    damping and a, and gains ∫ a dt of speed. That is about as much as speeds of the table are
    apart, and between them it is linear: hardest braking, its opposite and coasting are enough.

    Args:
        hinge: its constants.
        swing: from −σ to σ, (P,) rad.
        energy: the result over Q equally spaced speeds from −v_max to v_max, (P, Q) 1/s².
    """
    rows, columns = energy.shape
    for j in range(columns):
        energy[rows - 1, j] = 0.0
    for i in range(rows - 2, -1, -1):
        after = energy[i + 1]
        for j in range(columns):
            speed = hinge.speed * (2.0 * j / (columns - 1) - 1.0)
            largest = 0.0
            for sign in range(-1, 2):
                push = sign * hinge.acceleration
                found = _before(hinge, swing[i], swing[i + 1], speed, push, after)
                largest = max(largest, found)
            energy[i, j] = largest


@compilable
def _hold(hinge: Hinge, phi: float, rate: float, push: float) -> tuple[float, float, float]:
    """Return φ, φ̇ after a period of constant acceleration, and the largest |φ| on the way."""
    h = hinge.period / hinge.substeps
    farthest = abs(phi)
    for _ in range(hinge.substeps):
        k_1 = _turning(hinge, phi, rate, push)
        k_2 = _turning(hinge, phi + 0.5 * h * rate, rate + 0.5 * h * k_1, push)
        k_3 = _turning(hinge, phi + 0.5 * h * (rate + 0.5 * h * k_1), rate + 0.5 * h * k_2, push)
        k_4 = _turning(hinge, phi + h * (rate + 0.5 * h * k_2), rate + h * k_3, push)
        later = phi + h * (rate + h * (k_1 + k_2 + k_3) / 6.0)
        later_rate = rate + h * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4) / 6.0
        if rate * later_rate < 0.0:  # it turned on the way
            bend = (later_rate - rate) / h
            farthest = max(farthest, abs(phi - 0.5 * rate**2 / bend))
        phi, rate = later, later_rate
        farthest = max(farthest, abs(phi))
    return phi, rate, farthest


@compilable
def _turning(hinge: Hinge, phi: float, rate: float, push: float) -> float:
    pulled = hinge.pull * (GRAVITY_M_S2 * sin(phi) + push * cos(phi))
    return -pulled - hinge.damping * rate - hinge.stiffness * phi


@compilable
def _stops(
    hinge: Hinge, phi: float, rate: float, speed: float, share: float, most: int, edge: float
) -> bool:
    """Whether hardest braking, held, brings V to V_σ within ±σ.

    Args:
        hinge: its constants.
        phi: φ, rad.
        rate: φ̇, rad/s.
        speed: of the grasp, m/s.
        share: from hardest pushing on, 0, to hardest braking, 1, in the first period.
        most: periods that are simulated.
        edge: V_σ over the inertia, 1/s².
    """
    for _ in range(most):
        if 0.5 * rate**2 + potential(hinge, phi) <= edge:
            return True
        low = max(-hinge.acceleration, (-hinge.speed - speed) / hinge.period)
        high = min(hinge.acceleration, (hinge.speed - speed) / hinge.period)
        push = low + share * (high - low)
        if rate < 0.0:
            push = low
        share = 1.0
        phi, rate, farthest = _hold(hinge, phi, rate, push)
        speed += hinge.period * push
        if farthest > hinge.sigma * (1.0 + _ROUNDING):
            return False
    return False


@compilable
def _can_stay(hinge: Hinge, phi: float, rate: float, speed: float, most: int) -> bool:
    """Whether it can be stopped after none, one, two, … periods of running up.

    To run up means to push the swing on, which gains room to brake below the speed limit.
    """
    edge = potential(hinge, hinge.sigma) * (1.0 + _ROUNDING)
    for _ in range(most):
        for part in range(_PARTS):
            if _stops(hinge, phi, rate, speed, 1.0 - part / _PARTS, most, edge):
                return True
        push = max(-hinge.acceleration, (-hinge.speed - speed) / hinge.period)
        phi, rate, farthest = _hold(hinge, phi, rate, push)
        speed += hinge.period * push
        if farthest > hinge.sigma or rate < 0.0:
            return False
    return False


@compiled
def inner_energy(
    hinge: Hinge, swing: Array, speeds: Array, most: int, outer: Array, inner: Array
) -> None:
    """Write the largest ½ φ̇² found from which a held policy keeps the swing within ±σ.

    Args:
        hinge: its constants.
        swing: (P,) rad.
        speeds: (Q,) m/s.
        most: periods that are simulated.
        outer: ½ φ̇² that is not exceeded, (P, Q) 1/s².
        inner: the result, (P, Q) 1/s².
    """
    rows, columns = outer.shape
    for i in range(rows):
        for j in range(columns):
            if _can_stay(hinge, swing[i], sqrt(2.0 * outer[i, j]), speeds[j], most):
                inner[i, j] = outer[i, j]
                continue
            low = max(potential(hinge, hinge.sigma) - potential(hinge, swing[i]), 0.0)
            high = outer[i, j]
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                if _can_stay(hinge, swing[i], sqrt(2.0 * middle), speeds[j], most):
                    low = middle
                else:
                    high = middle
            inner[i, j] = low
