"""Rollouts of the nominal model under a backup law: what is safe beyond V ≤ V_σ, compiled.

A backup law drives the beam's momentum s = m_o12ᵀ ż2 out, w = r s / m within what the robot will
carry out, or coasts (r = 0). A command may pass if after it some law keeps ‖z2‖∞ ≤ σ, less a tube
for errors, until B is below its level: from there on the storage filter keeps it. The law's own
command starts the rest of the same rollout, so where one has passed another will: always feasible
for the model that is rolled out. Derivation: docs/derivations.md, section 19.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height
from defmanip_gym.theory.filters.barrier import (
    DecisionRoom,
    StorageLevels,
    coasting,
    speed_excess,
)
from defmanip_gym.theory.filters.decision import between, clipped
from defmanip_gym.theory.filters.foresight import advance_robot
from defmanip_gym.theory.filters.limits import farthest_share, forward_range, upward_range
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import (
    StorageModel,
    power_of,
    storage_at,
    swing_step,
    uncertain_storage,
)

_NOT_REACHED = -1e-6  # margin of a rollout that stays within the tube but does not end
_FADING = 0.9  # share of the acceleration beside what is foreseen that is left after a period


class BackupSetup(NamedTuple):
    """What rollouts depend on.

    Attributes:
        storage: levels at which the storage filter takes over; robot and errors.
        rolled: the beams with each damping that they may have: beam c is c, c + C, c + 2 C, …
        sigma: σ, rad.
        tube: what is kept back of σ after p periods, (P + 1, N) rad.
        spread: what an uncertainty of 1 rad of all angles has become after p periods, (P + 1, N).
        rates: r of the laws, (L,) 1/s.
        substeps: of a period.
        delay: periods that the state was already moved on by.
    """

    storage: StorageLevels
    rolled: StorageModel
    sigma: float
    tube: Array
    spread: Array
    rates: Array
    substeps: int
    delay: int


class BackupRoom(NamedTuple):
    """Room for one state."""

    decision: DecisionRoom
    ahead: Sensed  # of a rollout, one row

    @classmethod
    def empty(cls, segments: int) -> BackupRoom:
        """Return room for N segments."""
        return cls(DecisionRoom.empty(segments), Sensed.empty(1, segments))


@compilable
def box(
    setup: StorageLevels, sensed: Sensed, i: int
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the lower and upper corner of the commands that actuators and arm allow, m/s²."""
    limits = setup.limits
    reach, height = reach_and_height(limits.arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    forward_low, forward_high = forward_range(limits, reach, sensed.base_velocity[i, 1])
    up_low, up_high = upward_range(limits, reach, height, sensed.velocity_b[i, 2])
    largest = limits.max_acceleration_m_s2
    return (forward_low, -largest, up_low), (forward_high, largest, up_high)


@compilable
def backup_command(
    setup: BackupSetup, rate: float, sensed: Sensed, i: int
) -> tuple[float, float, float]:
    """Return a law's command, m/s², within actuators, arm and speed limit.

    Args:
        setup: of the rollouts.
        rate: r, 1/s.
        sensed: the states.
        i: which of them.
    """
    storage = setup.storage
    low, high = box(storage, sensed, i)
    coast = coasting(storage, sensed, i, (0.0, 0.0, 0.0))
    start = clipped(coast, low, high)
    if rate <= 0.0:
        return start
    forward = upward = 0.0
    for j in range(sensed.swing.shape[1]):
        momentum = storage.model.moments[0, j] * sensed.swing_rate[i, j]
        forward += momentum * cos(sensed.swing[i, j])
        upward += momentum * sin(sensed.swing[i, j])
    factor = rate / storage.model.mass[0]
    end = clipped((coast[0] + factor * forward, coast[1], coast[2] + factor * upward), low, high)
    velocity = sensed.velocity_b[i, 0], sensed.velocity_b[i, 1], sensed.velocity_b[i, 2]
    return between(start, end, farthest_share(storage.limits, start, end, velocity, low, high))


@compilable
def shown_margin(
    setup: BackupSetup,
    command: tuple[float, float, float],
    rate: float,
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    is_patient: bool,
) -> float:
    """Return what a command, followed by a law, leaves of σ until storage takes over, as a share.

    Negative: not shown to be safe. The least over the beams.

    Args:
        setup: of the rollouts.
        command: of the first period, m/s².
        rate: of the law, 1/s.
        sensed: the states.
        i: which of them.
        residual: accelerations beside those foreseen, of the last period, (n, 3) m/s².
        uncertainty: of the swing, (n, N) rad.
        room: for intermediate results.
        is_patient: roll on after the tube is left, to learn how far.
    """
    least = np.inf
    for r in range(len(setup.rolled.mass)):
        margin = _rolled_out(
            setup, r, command, rate, sensed, i, residual, uncertainty, room, is_patient
        )
        least = min(least, margin)
        if least < 0.0 and not is_patient:
            break
    return least


@compilable
def _rolled_out(
    setup: BackupSetup,
    r: int,
    command: tuple[float, float, float],
    rate: float,
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    is_patient: bool,
) -> float:
    storage, ahead, swung = setup.storage, room.ahead, room.decision.storage
    c = r % len(storage.levels)
    limits = storage.limits
    step_s = limits.period_s / setup.substeps
    _copy(sensed, i, ahead)
    beside = residual[i, 0], residual[i, 1], residual[i, 2]
    left, gained = setup.sigma, 0.0
    for period in range(1 + setup.delay, len(setup.tube)):
        if period > 1 + setup.delay:
            command = backup_command(setup, rate, ahead, 0)
            beside = _FADING * beside[0], _FADING * beside[1], _FADING * beside[2]
        grasp, yaw_rate, _ = advance_robot(limits, command, beside, ahead, 0)
        for j in range(len(swung.swing)):
            swung.swing[j], swung.swing_rate[j] = ahead.swing[0, j], ahead.swing_rate[0, j]
        for _ in range(setup.substeps):
            swing_step(
                setup.rolled,
                r,
                swung.swing,
                swung.swing_rate,
                grasp[0],
                grasp[2],
                yaw_rate,
                step_s,
                swung,
            )
            for j in range(len(swung.swing)):
                allowed = setup.sigma - setup.tube[period, j]
                allowed -= setup.spread[period, j] * uncertainty[i, j]
                left = min(left, allowed - abs(swung.swing[j]))
        if not (left >= 0.0 or is_patient):
            break
        s_forward, s_upward, inertia = power_of(storage.model, c, swung)
        reach, _ = reach_and_height(limits.arm, ahead.pitch[0, 0], ahead.pitch[0, 1])
        stored = gained + storage_at(
            storage.model, c, swung.swing, swung.swing_rate, ahead.base_velocity[0, 1], swung
        )
        stored += uncertain_storage(storage.model, c, uncertainty, i, swung)
        velocity = ahead.velocity_b[0]
        stored += storage.momenta[c] * speed_excess(
            limits.max_speed_m_s, velocity[0], velocity[1], velocity[2]
        )
        if stored <= storage.levels[c]:
            return left / setup.sigma
        # errors of the last period are the next decision's, and storage has made room for them
        gained += setup.storage.residual * storage.model.passes[c]
        gained += limits.period_s * (
            abs(s_forward) * storage.errors[0]
            + abs(yaw_rate * inertia / reach) * storage.errors[1]
            + abs(s_upward) * storage.errors[2]
        )
        for j in range(len(swung.swing)):
            ahead.swing[0, j], ahead.swing_rate[0, j] = swung.swing[j], swung.swing_rate[j]
    return min(left / setup.sigma, _NOT_REACHED)


@compilable
def _copy(sensed: Sensed, i: int, ahead: Sensed) -> None:
    for j in range(3):
        ahead.velocity_b[0, j] = sensed.velocity_b[i, j]
    for j in range(2):
        ahead.base_velocity[0, j] = sensed.base_velocity[i, j]
        ahead.pitch[0, j], ahead.pitch_rate[0, j] = sensed.pitch[i, j], sensed.pitch_rate[i, j]
    for j in range(sensed.swing.shape[1]):
        ahead.swing[0, j], ahead.swing_rate[0, j] = sensed.swing[i, j], sensed.swing_rate[i, j]
    ahead.heading[0] = sensed.heading[i]


@compilable
def distance(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    """Return how far apart two commands are, m/s²."""
    return sqrt((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2)
