"""The inequalities of the optimal control problem, in CasADi's symbols; all are at most zero."""

from __future__ import annotations

from typing import Any

from defmanip_gym.planning.limits import PlanLimits
from defmanip_gym.planning.model import VELOCITY, TransportModel, state_rates


def kept_at_nodes(casadi: Any, model: TransportModel, limits: PlanLimits, state: Any) -> list[Any]:
    """Return what is at most zero at every node but the first."""
    x, y, z, heading, forward, left, up, reach, _, swing, rate = casadi.vertsplit(state)
    arm = reach**2 + (z - limits.shoulder_m) ** 2
    base_x = x + model.goal_reach_m - reach * casadi.cos(heading)
    base_y = y - reach * casadi.sin(heading)
    kept = [
        forward**2 + left**2 + up**2 - limits.speed_m_s**2,
        arm - limits.longest_arm_m**2,
        limits.shortest_arm_m**2 - arm,
        base_x**2 + base_y**2 - limits.arena_radius_m**2,
    ]
    if limits.storage_swing_rad is not None:
        highest = float(model.storage(limits.storage_swing_rad, 0.0))
        kept.append(model.storage(swing, rate, casadi.cos) - highest)
    return kept


def kept_in_intervals(
    casadi: Any, model: TransportModel, limits: PlanLimits, states: Any, commands: Any
) -> list[Any]:
    """Return what is at most zero in every interval, of the drive force."""
    drive = limits.drive
    if drive is None:
        return []
    pulled = []
    for k in range(commands.shape[1]):
        state, w = casadi.vertsplit(states[:, k]), casadi.vertsplit(commands[:, k])
        rates = state_rates(model, state, w, casadi.sin, casadi.cos)
        force = drive.force(state, rates, w[0], casadi.sin, casadi.cos)
        pulled.append((force / drive.force_n) ** 2 - 1)
    return pulled


def kept_at_the_end(limits: PlanLimits, state: Any) -> list[Any]:
    """Return what is at most zero at the end."""
    position = sum(state[k] ** 2 for k in range(3))
    speed = sum(state[k] ** 2 for k in range(VELOCITY.start, VELOCITY.stop))
    return [
        position - limits.position_tolerance_m**2,
        speed - limits.speed_tolerance_m_s**2,
    ]
