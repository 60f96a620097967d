"""Where the search for a plan begins: straight legs, driven forwards or backwards, any way round.

A time-optimal problem with a heading has many local optima: forwards or backwards, turning left or
right at either end, and in several legs where the goal lies behind or beside the robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from defmanip_gym.planning.model import (
    COMMAND_SIZE,
    HEADING,
    POSITION,
    REACH,
    STATE_SIZE,
    SWING,
    Array,
    TransportModel,
)
from defmanip_gym.planning.plan import Plan

_CRUISE_SHARE = 0.85  # of the speed limit, on the straight legs
_TURNING_S = 1.0
_WAY_SHARE = 0.4  # by how much of the distance legs lead aside
_RUN_UP_M = 2.5
_GEARS = {1: "forwards", -1: "backwards"}


def guesses(
    model: TransportModel, state: Array, speed_m_s: float, intervals: int
) -> Iterator[Plan]:
    """Yield guesses of motions from a state to the goal.

    Args:
        model: of robot and beam.
        state: where they begin, (11,).
        speed_m_s: the limit.
        intervals: K of each guess.
    """
    plain = [(gear, turns) for turns in ((0, 0), (-1, 1), (1, -1)) for gear in (1, -1)]
    run_up = min(_RUN_UP_M, 0.5 * float(np.hypot(*state[:2])) + 0.5)
    across = _WAY_SHARE * np.array([-state[1], state[0]])
    ahead = run_up * np.array([np.cos(state[HEADING]), np.sin(state[HEADING])])
    bent = [
        ("before the goal", np.array([-run_up, 0.0]), (1, 1)),
        ("beyond the goal", np.array([run_up, 0.0]), (-1, -1)),
        ("the left", state[:2] / 2 + across, (1, 1)),
        ("the right", state[:2] / 2 - across, (1, 1)),
        ("before the goal", np.array([-run_up, 0.0]), (-1, 1)),
        ("beyond the goal", np.array([run_up, 0.0]), (1, -1)),
        ("what is ahead", state[:2] + ahead, (1, -1)),
        ("what is behind", state[:2] - ahead, (-1, 1)),
        ("the left", state[:2] / 2 + across, (-1, -1)),
        ("the right", state[:2] / 2 - across, (-1, -1)),
        ("the left", state[:2] / 2 + across, (1, -1)),
        ("the right", state[:2] / 2 - across, (1, -1)),
        ("the left", state[:2] / 2 + across, (-1, 1)),
        ("the right", state[:2] / 2 - across, (-1, 1)),
    ]
    for gear, turns in plain:
        name = f"{_GEARS[gear]}, turning {turns[0]:+d} and {turns[1]:+d}"
        yield _legs(model, state, [], (gear,), turns, speed_m_s, intervals, name)
    for place, way, gears in bent:
        name = f"{_GEARS[gears[0]]} by {place}, then {_GEARS[gears[1]]}"
        yield _legs(model, state, [way], gears, (0, 0), speed_m_s, intervals, name)


def _legs(
    model: TransportModel,
    state: Array,
    ways: Sequence[Array],
    gears: Sequence[int],
    turns: tuple[int, int],
    speed_m_s: float,
    intervals: int,
    name: str,
) -> Plan:
    """Return a guess along straight legs, one gear each, with extra turns at start and end."""
    corners = np.array([state[:2], *ways, np.zeros(2)])
    legs = np.diff(corners, axis=0)
    lengths = np.hypot(*legs.T) + 1e-3
    travelled = np.concatenate(([0.0], np.cumsum(lengths)))
    speed = _CRUISE_SHARE * speed_m_s
    headings = [float(state[HEADING])]
    for leg, gear in zip(legs, gears, strict=True):
        direction = float(np.arctan2(leg[1], leg[0])) + (np.pi if gear < 0 else 0.0)
        headings.append(headings[-1] + _wrapped(direction - headings[-1]))
    headings = [headings[0], *(heading + 2 * np.pi * turns[0] for heading in headings[1:])]
    headings.append(2 * np.pi * (np.round(headings[-1] / (2 * np.pi)) + turns[1]))

    share = np.linspace(0, 1, intervals + 1)
    distance = share * travelled[-1]
    states = np.zeros((intervals + 1, STATE_SIZE))
    for k in range(2):
        states[:, k] = np.interp(distance, travelled, corners[:, k])
    states[:, 2] = state[2] * (1 - share)
    # each heading holds over the middle of its leg
    inner = np.concatenate([travelled[:-1] + edge * lengths for edge in (0.25, 0.75)])
    knots = np.concatenate(([0.0], np.sort(inner), [travelled[-1]]))
    values = [headings[0], *np.repeat(headings[1:-1], 2), headings[-1]]
    states[:, HEADING] = np.interp(distance, knots, values)
    leg = np.minimum(np.searchsorted(travelled, distance, side="right") - 1, len(legs) - 1)
    rising = np.clip(np.minimum(share, 1 - share) / 0.15, 0.0, 1.0)
    states[:, 4] = np.array(gears)[leg] * speed * rising
    states[:, REACH] = model.goal_reach_m + (state[REACH] - model.goal_reach_m) * (1 - share)
    states[:, SWING] = state[SWING] * (1 - share)
    states[0, POSITION] = state[POSITION]
    return Plan(
        duration_s=float(travelled[-1] / speed + _TURNING_S),
        states=states,
        commands=np.zeros((intervals, COMMAND_SIZE)),
        guess=name,
    )


def _wrapped(angle: float) -> float:
    return float(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)
