"""The command nearest to a wished one that a rollout shows to be safe, compiled."""

from __future__ import annotations

import numpy as np

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.backup import (
    BackupRoom,
    BackupSetup,
    backup_command,
    box,
    distance,
    shown_margin,
)
from defmanip_gym.theory.filters.barrier import excess_after, speed_excess
from defmanip_gym.theory.filters.decision import between, clipped, within
from defmanip_gym.theory.filters.limits import braking, farthest_share
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import storage_at

_HALVINGS = 5


@compilable
def decide_backup(
    setup: BackupSetup,
    wished: Array,
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    allowed: Array,
) -> float:
    """Write the allowed command of state i; return its margin.

    Where the storage's own test passes the wish, that is what B leaves of V_σ, as a share. Where
    rollouts are asked, it is what they leave of σ, as a share; negative where none is safe.

    Args:
        setup: of the rollouts.
        wished: commands, (n, 3) m/s², finite, within the largest acceleration.
        sensed: the states.
        i: which of them.
        residual: accelerations beside those foreseen, of the last period, (n, 3) m/s².
        uncertainty: of the swing, (n, N) rad.
        room: for intermediate results.
        allowed: the result, (n, 3) m/s²: as wished where that may pass.
    """
    storage, limits, inner = setup.storage, setup.storage.limits, room.decision
    velocity = sensed.velocity_b[i, 0], sensed.velocity_b[i, 1], sensed.velocity_b[i, 2]
    wanted = limited_acceleration(
        wished[i, 0],
        wished[i, 1],
        wished[i, 2],
        velocity[0],
        velocity[1],
        velocity[2],
        limits.max_speed_m_s,
        limits.period_s,
    )
    low, high = box(storage, sensed, i)
    is_possible = low[0] <= wanted[0] <= high[0] and low[2] <= wanted[2] <= high[2]
    if not is_possible:
        start, end = clipped(braking(limits, velocity), low, high), clipped(wanted, low, high)
        wanted = between(start, end, farthest_share(limits, start, end, velocity, low, high))
    margin = -excess_after(storage, wanted, sensed, i, residual, uncertainty, inner)
    if margin < 0.0:
        margin = _best_margin(setup, wanted, sensed, i, residual, uncertainty, room)
    if margin >= 0.0:
        allowed[i, 0], allowed[i, 1], allowed[i, 2] = wanted[0], wanted[1], wanted[2]
        if is_possible:
            allowed[i, 0], allowed[i, 1], allowed[i, 2] = wished[i, 0], wished[i, 1], wished[i, 2]
        return margin
    chosen, margin = _nearest(
        setup, wanted, sensed, i, residual, uncertainty, room, velocity, low, high
    )
    if margin < 0.0:
        chosen, margin = _least_bad(
            setup, wanted, sensed, i, residual, uncertainty, room, velocity, low, high
        )
    allowed[i, 0], allowed[i, 1], allowed[i, 2] = chosen[0], chosen[1], chosen[2]
    return margin


@compilable
def _best_margin(
    setup: BackupSetup,
    command: tuple[float, float, float],
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
) -> float:
    """Return what the first law that shows a command to be safe leaves, or a negative number."""
    margin = -np.inf
    for law in range(len(setup.rates)):
        if margin < 0.0:
            rate = setup.rates[law]
            margin = shown_margin(
                setup, command, rate, sensed, i, residual, uncertainty, room, False
            )
    return margin


@compilable
def _nearest(
    setup: BackupSetup,
    wanted: tuple[float, float, float],
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    velocity: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float]:
    """Return the nearest of what storage allows and the last safe points on the way to the laws."""
    chosen, excess = within(
        setup.storage,
        wanted,
        sensed,
        i,
        residual,
        uncertainty,
        room.decision,
        velocity,
        low,
        high,
    )
    margin = -excess
    if margin >= 0.0:
        nearest = distance(chosen, wanted)
    else:
        nearest = np.inf
    for law in range(len(setup.rates)):
        rate = setup.rates[law]
        safe = backup_command(setup, rate, sensed, i)
        left = shown_margin(setup, safe, rate, sensed, i, residual, uncertainty, room, False)
        if left < 0.0:
            continue
        near, far = 0.0, 1.0
        for _ in range(_HALVINGS):
            if near * distance(wanted, safe) >= nearest:
                break
            middle = 0.5 * (near + far)
            tried = between(wanted, safe, middle)
            shown = shown_margin(setup, tried, rate, sensed, i, residual, uncertainty, room, False)
            if shown >= 0.0:
                far, left = middle, shown
            else:
                near = middle
        tried = between(wanted, safe, far)
        if distance(tried, wanted) < nearest:
            chosen, margin, nearest = tried, left, distance(tried, wanted)
            break
    return chosen, margin


@compilable
def _least_bad(
    setup: BackupSetup,
    wanted: tuple[float, float, float],
    sensed: Sensed,
    i: int,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    velocity: tuple[float, float, float],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float]:
    """Return the command whose rollout comes nearest to staying within σ, out of the arm or not."""
    largest = setup.storage.limits.max_acceleration_m_s2
    low, high = (low[0], -largest, -largest), (high[0], largest, largest)
    chosen, excess = within(
        setup.storage,
        wanted,
        sensed,
        i,
        residual,
        uncertainty,
        room.decision,
        velocity,
        low,
        high,
    )
    if excess <= 0.0:
        return chosen, -excess
    margin, safest = -np.inf, chosen
    for law in range(2 * len(setup.rates)):
        rate, tried = setup.rates[law // 2], safest
        if law % 2:
            tried = backup_command(setup, rate, sensed, i)
        left = shown_margin(setup, tried, rate, sensed, i, residual, uncertainty, room, True)
        if left > margin:
            chosen, margin = tried, left
    return chosen, margin


@compiled
def decide_backup_all(
    setup: BackupSetup,
    wished: Array,
    sensed: Sensed,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    allowed: Array,
    margins: Array,
) -> None:
    """Write allowed commands (n, 3) m/s² and margins (n,) of n states; see ``decide_backup``."""
    for i in range(len(wished)):
        margins[i] = decide_backup(setup, wished, sensed, i, residual, uncertainty, room, allowed)


@compiled
def show_all(
    setup: BackupSetup,
    sensed: Sensed,
    residual: Array,
    uncertainty: Array,
    room: BackupRoom,
    margins: Array,
) -> None:
    """Write what backup, from now on, leaves of σ, (n,), or of its level where B is below it."""
    storage, inner = setup.storage, room.decision
    for i in range(len(margins)):
        margins[i] = np.inf
        for j in range(len(inner.swing)):
            inner.swing[j], inner.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
        for c in range(len(storage.levels)):
            yaw_rate = sensed.base_velocity[i, 1]
            stored = storage_at(
                storage.model, c, inner.swing, inner.swing_rate, yaw_rate, inner.storage
            )
            velocity = sensed.velocity_b
            stored += storage.momenta[c] * speed_excess(
                storage.limits.max_speed_m_s, velocity[i, 0], velocity[i, 1], velocity[i, 2]
            )
            margins[i] = min(margins[i], 1.0 - stored / storage.levels[c])
        for law in range(len(setup.rates)):
            if margins[i] < 0.0:
                rate = setup.rates[law]
                command = backup_command(setup, rate, sensed, i)
                margins[i] = shown_margin(
                    setup, command, rate, sensed, i, residual, uncertainty, room, False
                )
