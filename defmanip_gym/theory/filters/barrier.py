"""What the storage asks of a command: B below its level after the period, errors included."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height, reach_and_height_slopes
from defmanip_gym.theory.filters.carried import (
    CarriedModel,
    CarriedRoom,
    power_of_carried,
    step_carried,
    stored_in_carried,
    uncertain_in_carried,
)
from defmanip_gym.theory.filters.limits import RobotLimits
from defmanip_gym.theory.filters.period_mean import mean_acceleration
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import StorageRoom


class StorageLevels(NamedTuple):
    """What the decision depends on.

    Attributes:
        model: of the beams that may be carried, or of the object.
        levels: up to which B may rise, (C,) J.
        momenta: s_f at its largest within V ≤ V_σ, (C,) kg·m/s.
        errors: of the period's mean acceleration about what is foreseen, (3,) m/s².
        residual: of B itself after a period, as a share of V_σ.
        limits: of the robot.
    """

    model: CarriedModel
    levels: Array
    momenta: Array
    errors: Array
    residual: float
    limits: RobotLimits


class DecisionRoom(NamedTuple):
    """Room for one state, and what was found out about the last command that was judged."""

    storage: CarriedRoom
    gradient: Array  # (3,): −∂B/∂w of the beam that allows least, J per m/s²
    swing: Array  # (N,)
    swing_rate: Array  # (N,)

    @classmethod
    def empty(cls, count: int, storage: CarriedRoom | None = None) -> DecisionRoom:
        """Return room for N segments of a rod, or for what another ``storage`` is the room of."""
        room = StorageRoom.empty(count) if storage is None else storage
        return cls(room, np.empty(3), np.empty(count), np.empty(count))


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

    Speed beyond the limit counts as if it were stored, too: what loses it may push the object all
    the while, and the limiter would not let it be countered.

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
    left += residual[i, 1]
    yaw_rate = sensed.base_velocity[i, 1]
    turning += residual[i, 1] / reach
    later_yaw_rate = yaw_rate + period_s * turning
    middle_yaw_rate = 0.5 * (yaw_rate + later_yaw_rate)
    fast = speed_excess(
        limits.max_speed_m_s,
        sensed.velocity_b[i, 0] + period_s * forward,
        sensed.velocity_b[i, 1] + period_s * left,
        sensed.velocity_b[i, 2] + period_s * upward,
    )
    for j in range(len(room.swing)):
        room.swing[j], room.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
    largest = -np.inf
    for c in range(len(setup.levels)):
        step_carried(
            model,
            c,
            room.swing,
            room.swing_rate,
            (forward, left, upward),
            middle_yaw_rate,
            turning,
            period_s,
            room.storage,
        )
        s_forward, leftward, s_upward = power_of_carried(
            model, c, middle_yaw_rate, reach, room.storage
        )
        after = stored_in_carried(
            model, c, room.storage.swing, room.storage.swing_rate, later_yaw_rate, room.storage
        )
        after += setup.momenta[c] * fast
        after += period_s * (
            abs(s_forward) * setup.errors[0]
            + abs(leftward) * setup.errors[1]
            + abs(s_upward) * setup.errors[2]
        )
        after += uncertain_in_carried(model, c, uncertainty, i, room.storage)
        excess = (after - setup.levels[c]) / model.passes[c] + setup.residual
        if excess > largest:
            largest = excess
            scale = period_s / model.passes[c]
            room.gradient[0] = scale * s_forward
            room.gradient[1] = scale * leftward
            room.gradient[2] = scale * s_upward
    return largest


@compilable
def reach_rate_of(limits: RobotLimits, sensed: Sensed, i: int) -> float:
    """Return ρ̇ of state i, m/s."""
    upper, fore, _, _ = reach_and_height_slopes(limits.arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    return upper * sensed.pitch_rate[i, 0] + fore * sensed.pitch_rate[i, 1]


@compilable
def speed_excess(limit: float, forward: float, left: float, up: float) -> float:
    """Return by how much a velocity is faster than a limit, m/s."""
    return max(sqrt(forward**2 + left**2 + up**2) - limit, 0.0)


@compilable
def coasting(
    setup: StorageLevels, sensed: Sensed, i: int, beside: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return the command under which B does not rise: what makes up for acceleration beside it.

    A base that is pushed backwards turns away by itself; holding its yaw rate slows the grasp.
    """
    reach_rate = reach_rate_of(setup.limits, sensed, i)
    pushed = min(sensed.base_velocity[i, 0] + 2.0 * reach_rate, 0.0)
    turning = sensed.base_velocity[i, 1] * pushed
    return -beside[0], turning - beside[1], -beside[2]
