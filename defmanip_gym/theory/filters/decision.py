"""The command nearest to a wished one under which B stays below its level: closed form, compiled.

What the storage asks for is a half space in w, {w : B after the period ≤ level}, what robot and
limiter leave alone a box and a ball (``limits``). All three contain the coasting command, so one
that is allowed always exists; errors ask for a little more, damping.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height
from defmanip_gym.theory.filters.barrier import (
    DecisionRoom,
    StorageLevels,
    coasting,
    excess_after,
    reach_rate_of,
)
from defmanip_gym.theory.filters.carried import reversing_with_carried
from defmanip_gym.theory.filters.limits import (
    braking,
    farthest_share,
    forward_range,
    upward_range,
)
from defmanip_gym.theory.filters.sensed import Sensed

_NEWTON_STEPS = 4
_HALVINGS = 14
_DAMPINGS = 5  # sizes of the damping command that are tried
_ROUNDING = 1e-9  # of an allowed excess over a level, as a share of it


@compilable
def between(
    start: tuple[float, float, float], end: tuple[float, float, float], share: float
) -> tuple[float, float, float]:
    """Return start + share (end − start)."""
    return (
        start[0] + share * (end[0] - start[0]),
        start[1] + share * (end[1] - start[1]),
        start[2] + share * (end[2] - start[2]),
    )


@compilable
def decide(
    setup: StorageLevels,
    wished: Array,
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
    allowed: Array,
) -> float:
    """Write the allowed command of state i; return its margin to the level, as a share of V_σ.

    Args:
        setup: levels, errors and robot.
        wished: commands, (n, 3) m/s², finite, within the largest acceleration.
        sensed: the states.
        i: which of them.
        residual: accelerations beside those foreseen, of the last period, (n, 3) m/s².
        uncertainty: of the swing, (n, N) rad.
        room: for intermediate results.
        allowed: the result, (n, 3) m/s²: as wished where that may pass.
    """
    limits = setup.limits
    velocity = sensed.velocity_b[i, 0], sensed.velocity_b[i, 1], sensed.velocity_b[i, 2]
    effective = limited_acceleration(
        wished[i, 0],
        wished[i, 1],
        wished[i, 2],
        velocity[0],
        velocity[1],
        velocity[2],
        limits.max_speed_m_s,
        limits.period_s,
    )
    reach, height = reach_and_height(limits.arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    forward_low, forward_high = forward_range(limits, reach, sensed.base_velocity[i, 1])
    up_low, up_high = upward_range(limits, reach, height, velocity[2])
    is_possible = forward_low <= effective[0] <= forward_high and up_low <= effective[2] <= up_high
    back_low, left_low, left_high = reversing_with_carried(
        setup.model,
        velocity[0] + reach_rate_of(limits, sensed, i),
        sensed.base_velocity[i, 1],
        reach,
        limits.period_s,
    )
    back_low = min(back_low - residual[i, 0], forward_high)
    left_low, left_high = left_low - residual[i, 1], left_high - residual[i, 1]
    is_possible = is_possible and back_low <= effective[0] and left_low <= effective[1] <= left_high
    excess = excess_after(setup, effective, sensed, i, residual, uncertainty, room)
    if is_possible and excess <= 0.0:
        allowed[i, 0], allowed[i, 1], allowed[i, 2] = wished[i, 0], wished[i, 1], wished[i, 2]
        return -excess
    largest = limits.max_acceleration_m_s2
    left_low = min(max(left_low, -largest), largest)
    left_high = max(min(left_high, largest), -largest)
    low, high = (max(forward_low, back_low), left_low, up_low), (forward_high, left_high, up_high)
    moved, excess = within(
        setup, effective, sensed, i, residual, uncertainty, room, velocity, low, high
    )
    if excess > 0.0:  # rather out of the arm's range than beyond the level
        low, high = (low[0], low[1], -largest), (high[0], high[1], largest)
        moved, excess = within(
            setup, effective, sensed, i, residual, uncertainty, room, velocity, low, high
        )
    for axis in range(3):
        allowed[i, axis] = 0.0  # where nothing can be foreseen, of an arm beyond its limits
        if moved[axis] > largest:  # by rounding
            allowed[i, axis] = largest
        elif moved[axis] < -largest:
            allowed[i, axis] = -largest
        elif moved[axis] == moved[axis]:
            allowed[i, axis] = moved[axis]
    return -excess if excess < np.inf else -np.inf


@compilable
def within(
    setup: StorageLevels,
    wished: tuple[float, float, float],
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
    velocity: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float]:
    """Return the allowed command within a box, or the one that comes nearest to being allowed."""
    moved, excess = _moved(
        setup, wished, sensed, i, residual, uncertainty, room, velocity, low, high
    )
    if excess <= 0.0:
        return moved, excess
    safe, safe_excess = _safest(setup, sensed, i, residual, uncertainty, room, velocity, low, high)
    return _on_the_way(setup, moved, safe, safe_excess, sensed, i, residual, uncertainty, room)


@compilable
def clipped(
    command: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[float, float, float]:
    """Return the command nearest to one within a box."""
    return (
        min(max(command[0], low[0]), high[0]),
        min(max(command[1], low[1]), high[1]),
        min(max(command[2], low[2]), high[2]),
    )


@compilable
def _moved(
    setup: StorageLevels,
    wished: tuple[float, float, float],
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
    velocity: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float]:
    """Return the wished command moved onto the half space within box and ball, and its excess.

    The slope of the half space changes a little with the command, hence a few steps.
    """
    limits, gradient = setup.limits, room.gradient
    start = clipped(braking(limits, velocity), low, high)
    end = clipped(wished, low, high)
    moved = between(start, end, farthest_share(limits, start, end, velocity, low, high))
    excess = excess_after(setup, moved, sensed, i, residual, uncertainty, room)
    for _ in range(_NEWTON_STEPS):
        if excess <= 0.0:
            break
        square = 0.0
        for axis in range(3):  # along the box where it ends
            is_low = gradient[axis] < 0.0 and moved[axis] <= low[axis]
            if is_low or (gradient[axis] > 0.0 and moved[axis] >= high[axis]):
                gradient[axis] = 0.0
            square += gradient[axis] ** 2
        if square <= 0.0:
            break
        factor = (excess + _ROUNDING) / square
        end = (
            moved[0] + factor * gradient[0],
            moved[1] + factor * gradient[1],
            moved[2] + factor * gradient[2],
        )
        end = clipped(end, low, high)
        moved = between(start, end, farthest_share(limits, start, end, velocity, low, high))
        excess = excess_after(setup, moved, sensed, i, residual, uncertainty, room)
    return moved, excess


@compilable
def _safest(
    setup: StorageLevels,
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
    velocity: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float]:
    """Return the command that leaves B smallest, of coasting and some dampings, and its excess."""
    limits = setup.limits
    beside = residual[i, 0], residual[i, 1], residual[i, 2]
    coast = clipped(coasting(setup, sensed, i, beside), low, high)
    best = coast
    least = excess_after(setup, coast, sensed, i, residual, uncertainty, room)
    norm = np.sqrt(room.gradient[0] ** 2 + room.gradient[1] ** 2 + room.gradient[2] ** 2)
    if norm <= 0.0:
        return best, least
    size = limits.max_acceleration_m_s2 / norm
    direction = size * room.gradient[0], size * room.gradient[1], size * room.gradient[2]
    for _ in range(_DAMPINGS):
        end = coast[0] + direction[0], coast[1] + direction[1], coast[2] + direction[2]
        end = clipped(end, low, high)
        end = between(coast, end, farthest_share(limits, coast, end, velocity, low, high))
        excess = excess_after(setup, end, sensed, i, residual, uncertainty, room)
        if excess < least:
            best, least = end, excess
        direction = 0.5 * direction[0], 0.5 * direction[1], 0.5 * direction[2]
    return best, least


@compilable
def _on_the_way(
    setup: StorageLevels,
    wanted: tuple[float, float, float],
    safe: tuple[float, float, float],
    safe_excess: float,
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
) -> tuple[tuple[float, float, float], float]:
    """Return the point nearest to ``wanted`` on the way to ``safe`` that is allowed, if any is."""
    if safe_excess > 0.0:
        return safe, safe_excess
    found, excess = safe, safe_excess
    near, far = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        tried = between(wanted, safe, middle)
        tried_excess = excess_after(setup, tried, sensed, i, residual, uncertainty, room)
        if tried_excess <= 0.0:
            far, found, excess = middle, tried, tried_excess
        else:
            near = middle
    return found, excess
