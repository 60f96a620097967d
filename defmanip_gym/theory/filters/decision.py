"""The command nearest to a wished one under which B stays below its level: closed form, compiled.

What the storage asks for is a half space in w, {w : B after the period ≤ level}, what robot and
limiter leave alone a box and a ball (``limits``). All three contain the coasting command, so one
that is allowed always exists; errors ask for a little more, damping.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height, reach_and_height_slopes
from defmanip_gym.theory.filters.limits import (
    RobotLimits,
    braking,
    farthest_share,
    forward_range,
    upward_range,
)
from defmanip_gym.theory.filters.period_mean import mean_acceleration
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import (
    StorageModel,
    StorageRoom,
    power_of,
    storage_at,
    swing_step,
)

_NEWTON_STEPS = 4
_HALVINGS = 14
_DAMPINGS = 5  # sizes of the damping command that are tried
_ROUNDING = 1e-9  # of an allowed excess over a level, as a share of it


class StorageLevels(NamedTuple):
    """What the decision depends on.

    Attributes:
        model: of the beams that may be carried.
        levels: up to which B may rise, (C,) J.
        errors: of the period's mean acceleration about what is foreseen, (3,) m/s².
        residual: of B itself after a period, as a share of V_σ.
        limits: of the robot.
    """

    model: StorageModel
    levels: Array
    errors: Array
    residual: float
    limits: RobotLimits


class DecisionRoom(NamedTuple):
    """Room for one state, and what was found out about the last command that was judged."""

    storage: StorageRoom
    gradient: Array  # (3,): −∂B/∂w of the beam that allows least, J per m/s²
    swing: Array  # (N,)
    swing_rate: Array  # (N,)

    @classmethod
    def empty(cls, segments: int) -> DecisionRoom:
        """Return room for N segments."""
        return cls(StorageRoom.empty(segments), np.empty(3), np.empty(segments), np.empty(segments))


@compilable
def excess_after(
    setup: StorageLevels,
    command: tuple[float, float, float],
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
) -> float:
    """Return the largest (B after a period − level) / V_σ over the beams, errors included.

    Args:
        setup: levels, errors and robot.
        command: that takes effect as it is, m/s².
        sensed: the states.
        i: which of them.
        residual: accelerations beside those foreseen, of the last period, (n, 3) m/s².
        uncertainty: of the swing, (n, N) rad.
        room: ``gradient`` is written.
    """
    limits, model = setup.limits, setup.model
    period_s = limits.period_s
    forward, left, upward, turning = mean_acceleration(
        limits.arm,
        limits.rule,
        command[0],
        command[1],
        command[2],
        sensed.pitch[i, 0],
        sensed.pitch[i, 1],
        sensed.pitch_rate[i, 0],
        sensed.pitch_rate[i, 1],
        sensed.base_velocity[i, 0],
        sensed.base_velocity[i, 1],
        period_s,
    )
    reach, _ = reach_and_height(limits.arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    forward, upward = forward + residual[i, 0], upward + residual[i, 2]
    yaw_rate = sensed.base_velocity[i, 1]
    later_yaw_rate = yaw_rate + period_s * (turning + residual[i, 1] / reach)
    middle_yaw_rate = 0.5 * (yaw_rate + later_yaw_rate)
    for j in range(len(room.swing)):
        room.swing[j], room.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
    largest = -np.inf
    for c in range(len(setup.levels)):
        swing_step(
            model,
            c,
            room.swing,
            room.swing_rate,
            forward,
            upward,
            middle_yaw_rate,
            period_s,
            room.storage,
        )
        s_forward, s_upward, inertia = power_of(model, c, room.storage)
        leftward = -middle_yaw_rate * inertia / reach
        after = storage_at(
            model, c, room.storage.swing, room.storage.swing_rate, later_yaw_rate, room.storage
        )
        after += period_s * (
            abs(s_forward) * setup.errors[0]
            + abs(leftward) * setup.errors[1]
            + abs(s_upward) * setup.errors[2]
        )
        after += uncertain_storage(model, c, uncertainty, i, room.storage)
        excess = (after - setup.levels[c]) / model.passes[c] + setup.residual
        if excess > largest:
            largest = excess
            scale = period_s / model.passes[c]
            room.gradient[0] = scale * s_forward
            room.gradient[1] = scale * leftward
            room.gradient[2] = scale * s_upward
    return largest


@compilable
def uncertain_storage(
    model: StorageModel, c: int, uncertainty: Array, i: int, room: StorageRoom
) -> float:
    """Return how much more than in ``room`` may be stored, J, if angles are uncertain.

    Args:
        model: of the beams.
        c: which of them.
        uncertainty: of the swing, (n, N) rad.
        i: which state.
        room: what ``storage_at`` left of that state's swing, which is in ``room.swing``.
    """
    more = 0.0
    for j in range(len(room.swing)):
        slope = GRAVITY_M_S2 * model.moments[c, j] * abs(room.sine[j])
        for k in range(len(room.swing)):
            slope += abs(model.stiffness[c, j, k] * room.swing[k])
            curvature = abs(model.stiffness[c, j, k]) * uncertainty[i, k]
            more += 0.5 * curvature * uncertainty[i, j]
        curvature = GRAVITY_M_S2 * model.moments[c, j] * uncertainty[i, j]
        more += (slope + 0.5 * curvature) * uncertainty[i, j]
    return more


@compilable
def coasting(setup: StorageLevels, sensed: Sensed, i: int) -> tuple[float, float, float]:
    """Return the command under which B does not rise: none, or what keeps |u2| from rising.

    A base that is pushed backwards turns away by itself; holding its yaw rate slows the grasp.
    """
    arm = setup.limits.arm
    rho_1, rho_2, _, _ = reach_and_height_slopes(arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    reach_rate = rho_1 * sensed.pitch_rate[i, 0] + rho_2 * sensed.pitch_rate[i, 1]
    pushed = min(sensed.base_velocity[i, 0] + 2.0 * reach_rate, 0.0)
    return 0.0, sensed.base_velocity[i, 1] * pushed, 0.0


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
    excess = excess_after(setup, effective, sensed, i, residual, uncertainty, room)
    if is_possible and excess <= 0.0:
        allowed[i, 0], allowed[i, 1], allowed[i, 2] = wished[i, 0], wished[i, 1], wished[i, 2]
        return -excess
    largest = limits.max_acceleration_m_s2
    low, high = (forward_low, -largest, up_low), (forward_high, largest, up_high)
    moved, excess = within(
        setup, effective, sensed, i, residual, uncertainty, room, velocity, low, high
    )
    if excess > 0.0:  # rather out of the arm's range than beyond the level
        low, high = (forward_low, -largest, -largest), (forward_high, largest, largest)
        moved, excess = within(
            setup, effective, sensed, i, residual, uncertainty, room, velocity, low, high
        )
    allowed[i, 0], allowed[i, 1], allowed[i, 2] = moved[0], moved[1], moved[2]
    return -excess


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
    coast = clipped(coasting(setup, sensed, i), low, high)
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


@compiled
def decide_all(
    setup: StorageLevels,
    wished: Array,
    sensed: Sensed,
    residual: Array,
    uncertainty: Array,
    room: DecisionRoom,
    allowed: Array,
    margins: Array,
) -> None:
    """Write the allowed commands (n, 3) m/s² and margins (n,) of n states; see ``decide``."""
    for i in range(len(wished)):
        margins[i] = decide(setup, wished, sensed, i, residual, uncertainty, room, allowed)


@compiled
def foresee_all(setup: StorageLevels, commands: Array, sensed: Sensed, foreseen: Array) -> None:
    """Write the mean accelerations (n, 3) m/s² that commands (n, 3) of a period should make."""
    limits = setup.limits
    for i in range(len(commands)):
        forward, left, up = limited_acceleration(
            commands[i, 0],
            commands[i, 1],
            commands[i, 2],
            sensed.velocity_b[i, 0],
            sensed.velocity_b[i, 1],
            sensed.velocity_b[i, 2],
            limits.max_speed_m_s,
            limits.period_s,
        )
        foreseen[i, 0], foreseen[i, 1], foreseen[i, 2], _ = mean_acceleration(
            limits.arm,
            limits.rule,
            forward,
            left,
            up,
            sensed.pitch[i, 0],
            sensed.pitch[i, 1],
            sensed.pitch_rate[i, 0],
            sensed.pitch_rate[i, 1],
            sensed.base_velocity[i, 0],
            sensed.base_velocity[i, 1],
            limits.period_s,
        )


@compiled
def store_all(setup: StorageLevels, sensed: Sensed, room: DecisionRoom, shares: Array) -> None:
    """Write B over its level, of the beam where it is largest, (n,), for n states."""
    for i in range(len(shares)):
        for j in range(len(room.swing)):
            room.swing[j], room.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
        shares[i] = 0.0
        for c in range(len(setup.levels)):
            stored = storage_at(
                setup.model,
                c,
                room.swing,
                room.swing_rate,
                sensed.base_velocity[i, 1],
                room.storage,
            )
            shares[i] = max(shares[i], stored / setup.levels[c])
