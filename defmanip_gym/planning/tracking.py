"""Following plans: linear-quadratic regulation about each of them, sampled (LQR, time-varying).

About the planned motion x_k, w_k the deviation obeys e_{k+1} = A_k e_k + B_k δw_k, exactly
discretized for w held over a period. The gains minimize Σ eᵀQe + δwᵀRδw by the Riccati recursion
backwards from the goal, where they go over into those of the regulator that holds the grasp there.
B. D. O. Anderson and J. B. Moore, "Optimal Control: Linear Quadratic Methods", 1990.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from defmanip_gym.planning.model import (
    COMMAND_SIZE,
    HEADING,
    POSITION,
    REACH,
    STATE_SIZE,
    SWING,
    SWING_RATE,
    VELOCITY,
    Array,
    TransportModel,
    advanced_rows,
)
from defmanip_gym.planning.plan import Plan
from defmanip_gym.validation import require_positive, settle

# at rest the heading cannot be steered, and the reach follows its own rule anyhow
_REGULATED = [*range(3), *range(4, 7), SWING, SWING_RATE]
_STEP = 1e-5  # of the central differences


@dataclass(frozen=True, kw_only=True)
class TrackingWeights:
    """Deviations that cost as much as one another: Q and R are their inverse squares.

    Attributes:
        position_m: of the grasp, each axis.
        heading_rad: of the base.
        velocity_m_s: of the grasp, each axis.
        swing_rad: φ.
        swing_rate_rad_s: φ̇.
        command_m_s2: w, each axis.
    """

    position_m: float = 0.05
    heading_rad: float = 0.1
    velocity_m_s: float = 0.1
    swing_rad: float = 0.05
    swing_rate_rad_s: float = 0.25
    command_m_s2: float = 0.5

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            settle(self, name, require_positive)

    @property
    def state_cost(self) -> Array:
        """Q, (11, 11)."""
        cost = np.zeros(STATE_SIZE)
        cost[POSITION], cost[HEADING] = self.position_m**-2, self.heading_rad**-2
        cost[VELOCITY] = self.velocity_m_s**-2
        cost[SWING], cost[SWING_RATE] = self.swing_rad**-2, self.swing_rate_rad_s**-2
        return np.diag(cost)

    @property
    def command_cost(self) -> Array:
        """R, (3, 3)."""
        return np.eye(COMMAND_SIZE) * self.command_m_s2**-2


@dataclass(frozen=True, kw_only=True)
class Track:
    """A plan in samples, with gains about it.

    Attributes:
        states: (S + 1, 11).
        commands: w, (S, 3) m/s².
        gains: K_k of w = w_k − K_k e, (S, 3, 11).
    """

    states: Array
    commands: Array
    gains: Array


def track_of(model: TransportModel, plan: Plan, period_s: float, weights: TrackingWeights) -> Track:
    """Return what following a plan in samples takes."""
    states, commands = plan.sampled(model, period_s)
    A, B = linearized(model, states[:-1], commands, period_s)
    Q, R = weights.state_cost, weights.command_cost
    P = np.zeros((STATE_SIZE, STATE_SIZE))
    P[np.ix_(_REGULATED, _REGULATED)] = _regulator(model, period_s, weights)[1]
    gains = np.empty((len(commands), COMMAND_SIZE, STATE_SIZE))
    for k in range(len(commands) - 1, -1, -1):
        gains[k] = np.linalg.solve(R + B[k].T @ P @ B[k], B[k].T @ P @ A[k])
        P = Q + A[k].T @ P @ (A[k] - B[k] @ gains[k])
        P = (P + P.T) / 2
    return Track(states=states, commands=commands, gains=gains)


def holding_gain(model: TransportModel, period_s: float, weights: TrackingWeights) -> Array:
    """Return K of w = −K e that holds the grasp at the goal, (3, 11); e in axes of the base."""
    gain = np.zeros((COMMAND_SIZE, STATE_SIZE))
    gain[:, _REGULATED] = _regulator(model, period_s, weights)[0]
    return gain


def linearized(
    model: TransportModel, states: Array, commands: Array, period_s: float
) -> tuple[Array, Array]:
    """Return A (S, 11, 11) and B (S, 11, 3) of the motion over a period, by central differences."""

    def slopes(column: int, of_state: bool) -> Array:
        size = STATE_SIZE if of_state else COMMAND_SIZE
        step = _STEP * np.eye(size)[column]
        ends = [
            advanced_rows(
                model,
                states + sign * step if of_state else states,
                commands if of_state else commands + sign * step,
                period_s,
            )
            for sign in (1, -1)
        ]
        slope: Array = (ends[0] - ends[1]) / (2 * _STEP)
        return slope

    A = np.stack([slopes(column, True) for column in range(STATE_SIZE)], axis=-1)
    B = np.stack([slopes(column, False) for column in range(COMMAND_SIZE)], axis=-1)
    return A, B


def _regulator(
    model: TransportModel, period_s: float, weights: TrackingWeights
) -> tuple[Array, Array]:
    """Return gain and cost of holding the grasp at the goal, of what can be regulated there."""
    rest = np.zeros((1, STATE_SIZE))
    rest[:, REACH] = model.goal_reach_m
    A, B = linearized(model, rest, np.zeros((1, COMMAND_SIZE)), period_s)
    chosen = np.ix_(_REGULATED, _REGULATED)
    A_0, B_0 = A[0][chosen], B[0][_REGULATED]
    Q, R = weights.state_cost[chosen], weights.command_cost
    P = solve_discrete_are(A_0, B_0, Q, R)
    return np.linalg.solve(R + B_0.T @ P @ B_0, B_0.T @ P @ A_0), P
