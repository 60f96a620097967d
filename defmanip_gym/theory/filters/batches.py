"""The filters' loops over episodes: what Python calls (``compiled``)."""

from __future__ import annotations

from math import inf

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.barrier import DecisionRoom, StorageLevels, speed_excess
from defmanip_gym.theory.filters.carried import step_carried, stored_in_carried
from defmanip_gym.theory.filters.decision import decide
from defmanip_gym.theory.filters.foresight import advance, advance_robot
from defmanip_gym.theory.filters.limits import RobotLimits
from defmanip_gym.theory.filters.period_mean import mean_acceleration
from defmanip_gym.theory.filters.sensed import Sensed, gained_acceleration


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
def compare_all(
    setup: StorageLevels,
    commands: Array,
    before: Sensed,
    after: Sensed,
    residual: Array,
    surprise: Array,
    largest: Array,
) -> None:
    """Write what a period's acceleration had beside what was foreseen, and how that has changed.

    Args:
        setup: with the robot.
        commands: of the period, (n, 3) m/s².
        before: n states.
        after: those a period later.
        residual: of the period before, and then of this, (n, 3) m/s².
        surprise: by how much it has changed, (n, 3) m/s².
        largest: of all n the largest changes and residuals, (6,) m/s².
    """
    limits = setup.limits
    for axis in range(6):
        largest[axis] = 0.0
    for i in range(len(commands)):
        forward, left, up = limited_acceleration(
            commands[i, 0],
            commands[i, 1],
            commands[i, 2],
            before.velocity_b[i, 0],
            before.velocity_b[i, 1],
            before.velocity_b[i, 2],
            limits.max_speed_m_s,
            limits.period_s,
        )
        forward, left, up, _ = mean_acceleration(
            limits.arm,
            limits.rule,
            forward,
            left,
            up,
            before.pitch[i, 0],
            before.pitch[i, 1],
            before.pitch_rate[i, 0],
            before.pitch_rate[i, 1],
            before.base_velocity[i, 0],
            before.base_velocity[i, 1],
            limits.period_s,
        )
        gained = gained_acceleration(before, after, i, limits.period_s)
        forward, left, up = gained[0] - forward, gained[1] - left, gained[2] - up
        surprise[i, 0] = forward - residual[i, 0]
        surprise[i, 1] = left - residual[i, 1]
        surprise[i, 2] = up - residual[i, 2]
        residual[i, 0], residual[i, 1], residual[i, 2] = forward, left, up
        for axis in range(3):
            largest[axis] = _larger(largest[axis], abs(surprise[i, axis]))
            largest[3 + axis] = _larger(largest[3 + axis], abs(residual[i, axis]))


@compilable
def _larger(one: float, other: float) -> float:
    """Return the larger of two numbers; infinity where the second one is none."""
    if other <= one:
        return one
    return other if other > one else inf


@compiled
def store_all(setup: StorageLevels, sensed: Sensed, room: DecisionRoom, shares: Array) -> None:
    """Write B over its level, of the beam where it is largest, (n,), for n states."""
    for i in range(len(shares)):
        for j in range(len(room.swing)):
            room.swing[j], room.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
        velocity = sensed.velocity_b
        fast = speed_excess(
            setup.limits.max_speed_m_s, velocity[i, 0], velocity[i, 1], velocity[i, 2]
        )
        shares[i] = 0.0
        for c in range(len(setup.levels)):
            stored = stored_in_carried(
                setup.model,
                c,
                room.swing,
                room.swing_rate,
                sensed.base_velocity[i, 1],
                room.storage,
            )
            stored += setup.momenta[c] * fast
            shares[i] = max(shares[i], stored / setup.levels[c])


@compiled
def advance_all(
    setup: StorageLevels, commands: Array, residual: Array, sensed: Sensed, room: DecisionRoom
) -> None:
    """Move n states on by a period of their commands, in place; see ``advance``."""
    for i in range(len(commands)):
        advance(setup, commands, residual, sensed, i, room)


@compiled
def drive_all(
    limits: RobotLimits, commands: Array, beside: Array, sensed: Sensed, motions: Array
) -> None:
    """Move n robots on by a period of their commands, in place; what they carry stays.

    Args:
        limits: of the robots.
        commands: (n, 3) m/s².
        beside: accelerations beside those foreseen, (n, 3) m/s².
        sensed: the states.
        motions: the result, (n, 4): the grasp's mean acceleration, m/s², and u̇2, rad/s².
    """
    for i in range(len(commands)):
        command = commands[i, 0], commands[i, 1], commands[i, 2]
        pushed = beside[i, 0], beside[i, 1], beside[i, 2]
        grasp, _, turning = advance_robot(limits, command, pushed, sensed, i)
        motions[i, 0], motions[i, 1], motions[i, 2] = grasp[0], grasp[1], grasp[2]
        motions[i, 3] = turning


@compiled
def misjudge_all(
    setup: StorageLevels,
    before: Sensed,
    after: Sensed,
    room: DecisionRoom,
    shares: Array,
) -> None:
    """Write how far B after a period exceeds what its mean acceleration makes foresee, over V_σ.

    Args:
        setup: of which the first beam is carried.
        before: n states.
        after: those a period later.
        room: for intermediate results.
        shares: the result, (n,).
    """
    for i in range(len(shares)):
        period_s = setup.limits.period_s
        gained = gained_acceleration(before, after, i, period_s)
        yaw_rate, later_yaw_rate = before.base_velocity[i, 1], after.base_velocity[i, 1]
        for j in range(len(room.swing)):
            room.swing[j], room.swing_rate[j] = before.swing[i, j], before.swing_rate[i, j]
        step_carried(
            setup.model,
            0,
            room.swing,
            room.swing_rate,
            gained,
            0.5 * (yaw_rate + later_yaw_rate),
            (later_yaw_rate - yaw_rate) / period_s,
            period_s,
            room.storage,
        )
        foreseen = stored_in_carried(
            setup.model,
            0,
            room.storage.swing,
            room.storage.swing_rate,
            later_yaw_rate,
            room.storage,
        )
        for j in range(len(room.swing)):
            room.swing[j], room.swing_rate[j] = after.swing[i, j], after.swing_rate[i, j]
        stored = stored_in_carried(
            setup.model, 0, room.swing, room.swing_rate, later_yaw_rate, room.storage
        )
        shares[i] = (stored - foreseen) / setup.model.passes[0]
