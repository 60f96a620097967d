"""The state at the time when a command will take effect: through the commands under way."""

from __future__ import annotations

from math import cos, sin

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.redundancy import shared_acceleration
from defmanip_gym.theory.dynamics.robot_model import reach_and_height
from defmanip_gym.theory.filters.barrier import DecisionRoom, StorageLevels
from defmanip_gym.theory.filters.carried import step_carried
from defmanip_gym.theory.filters.limits import RobotLimits
from defmanip_gym.theory.filters.period_mean import mean_acceleration
from defmanip_gym.theory.filters.sensed import Sensed


@compilable
def advance(
    setup: StorageLevels,
    commands: Array,
    residual: Array,
    sensed: Sensed,
    i: int,
    room: DecisionRoom,
) -> None:
    """Move state i on by a period of its command, in place.

    Args:
        setup: robot and beams, of which the first is believed.
        commands: (n, 3) m/s².
        residual: accelerations beside those foreseen, (n, 3) m/s².
        sensed: the states.
        i: which of them.
        room: for intermediate results.
    """
    beside = residual[i, 0], residual[i, 1], residual[i, 2]
    command = commands[i, 0], commands[i, 1], commands[i, 2]
    grasp, yaw_rate, turning = advance_robot(setup.limits, command, beside, sensed, i)
    for j in range(len(room.swing)):
        room.swing[j], room.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
    period_s = setup.limits.period_s
    step_carried(
        setup.model,
        0,
        room.swing,
        room.swing_rate,
        grasp,
        yaw_rate,
        turning,
        period_s,
        room.storage,
    )
    for j in range(len(room.swing)):
        sensed.swing[i, j] = room.storage.swing[j]
        sensed.swing_rate[i, j] = room.storage.swing_rate[j]


@compilable
def advance_robot(
    limits: RobotLimits,
    command: tuple[float, float, float],
    beside: tuple[float, float, float],
    sensed: Sensed,
    i: int,
) -> tuple[tuple[float, float, float], float, float]:
    """Move robot and grasp of a state on by a period; return what that does to its object.

    Args:
        limits: of the robot.
        command: before the speed limiter, m/s².
        beside: acceleration beside what is foreseen, m/s².
        sensed: the states; the swing stays as it is.
        i: which of them.

    Returns:
        The grasp's mean acceleration forward, left and upward, m/s², the yaw rate in the period's
        middle, rad/s, and u̇2, rad/s².
    """
    period_s, half = limits.period_s, 0.5 * limits.period_s
    velocity, base, rate = sensed.velocity_b, sensed.base_velocity, sensed.pitch_rate
    w = limited_acceleration(
        command[0],
        command[1],
        command[2],
        velocity[i, 0],
        velocity[i, 1],
        velocity[i, 2],
        limits.max_speed_m_s,
        period_s,
    )
    upper, fore = sensed.pitch[i, 0], sensed.pitch[i, 1]
    forward, left, up, turning = mean_acceleration(
        limits.arm,
        limits.rule,
        w[0],
        w[1],
        w[2],
        upper,
        fore,
        rate[i, 0],
        rate[i, 1],
        base[i, 0],
        base[i, 1],
        period_s,
    )
    driving, _, upper_dot, fore_dot = shared_acceleration(
        limits.arm,
        limits.rule,
        w[0],
        w[1],
        w[2],
        upper + half * rate[i, 0],
        fore + half * rate[i, 1],
        rate[i, 0],
        rate[i, 1],
        base[i, 0],
        base[i, 1],
    )
    reach, _ = reach_and_height(limits.arm, upper, fore)
    forward, left, up = forward + beside[0], left + beside[1], up + beside[2]
    turning += beside[1] / reach
    yaw_rate = base[i, 1] + half * turning
    # the acceleration is in the axes of the period's middle
    cosine, sine = cos(half * yaw_rate), sin(half * yaw_rate)
    ahead = cosine * velocity[i, 0] + sine * velocity[i, 1] + period_s * forward
    aside = cosine * velocity[i, 1] - sine * velocity[i, 0] + period_s * left
    velocity[i, 0] = cosine * ahead + sine * aside
    velocity[i, 1] = cosine * aside - sine * ahead
    velocity[i, 2] += period_s * up
    base[i, 0] += period_s * (driving + beside[0])
    base[i, 1] += period_s * turning
    sensed.heading[i] += period_s * yaw_rate
    sensed.pitch[i, 0] += period_s * (rate[i, 0] + half * upper_dot)
    sensed.pitch[i, 1] += period_s * (rate[i, 1] + half * fore_dot)
    rate[i, 0] += period_s * upper_dot
    rate[i, 1] += period_s * fore_dot
    return (forward, left, up), yaw_rate, turning
