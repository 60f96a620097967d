"""The optimal control problem by direct multiple shooting, solved by CasADi's IPOPT.

    minimize T + weight ∫|w|² dt   subject to   ẋ = f(x, w), limits at all nodes, tolerances at T

w is constant in each of K equal intervals. The limits hold at the nodes; what passes between them
shrinks with the intervals.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from defmanip_gym.errors import InstallationError
from defmanip_gym.planning.constraints import (
    kept_at_nodes,
    kept_at_the_end,
    kept_in_intervals,
)
from defmanip_gym.planning.limits import PlanLimits
from defmanip_gym.planning.model import (
    COMMAND_SIZE,
    HEADING,
    STATE_SIZE,
    SWING,
    Array,
    TransportModel,
    advanced,
)
from defmanip_gym.planning.plan import Plan
from defmanip_gym.validation import require_whole

# no transport that anybody waits for is outside of these
_SHORTEST_S, _LONGEST_S = 0.02, 120.0
_OPTIONS = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 150,
    "ipopt.tol": 1e-5,
    "ipopt.acceptable_tol": 1e-4,
    "ipopt.mu_strategy": "adaptive",
}


class TransportProblem:
    """Time-optimal transport from any state, with K intervals.

    Args:
        model: of robot and beam.
        limits: that the motion keeps to.
        intervals: K.

    Raises:
        InstallationError: CasADi is not installed.
    """

    def __init__(self, model: TransportModel, limits: PlanLimits, intervals: int) -> None:
        self.model, self.limits = model, limits
        self.intervals = require_whole("intervals", intervals, 2, 2000)
        casadi = require_casadi()
        states = casadi.SX.sym("states", STATE_SIZE, intervals + 1)
        commands = casadi.SX.sym("commands", COMMAND_SIZE, intervals)
        duration, start = casadi.SX.sym("duration"), casadi.SX.sym("start", STATE_SIZE)
        interval = duration / intervals
        rows = [states[:, 0] - start]
        for k in range(intervals):
            state, w = casadi.vertsplit(states[:, k]), casadi.vertsplit(commands[:, k])
            following = advanced(model, state, w, interval, casadi.sin, casadi.cos)
            rows.append(states[:, k + 1] - casadi.vertcat(*following))
        equalities = casadi.vertcat(*rows)
        kept = kept_in_intervals(casadi, model, limits, states, commands)
        for k in range(1, intervals + 1):
            kept += kept_at_nodes(casadi, model, limits, states[:, k])
        kept += kept_at_the_end(limits, states[:, intervals])
        inequalities = casadi.vertcat(*kept)
        effort = limits.effort_weight * interval * casadi.sumsqr(commands)
        motion = casadi.vec(casadi.vertcat(states[:, :intervals], commands))
        program = {
            "x": casadi.vertcat(duration, motion, states[:, intervals]),
            "p": start,
            "f": duration + effort,
            "g": casadi.vertcat(equalities, inequalities),
        }
        self._solver = casadi.nlpsol("transport", "ipopt", program, _OPTIONS)
        self._lower = np.zeros(program["g"].numel())
        self._lower[equalities.numel() :] = -np.inf
        self._low, self._high = self._bounds()

    def solve(self, state: Array, guess: Plan) -> Plan | None:
        """Return the plan that IPOPT finds from a guess; None where it finds none.

        Args:
            state: where it begins, (11,).
            guess: whose last heading says which turn of it the goal's heading is.
        """
        guess = guess if len(guess.commands) == self.intervals else guess.resampled(self.intervals)
        turn = 2 * np.pi * np.round(guess.states[-1, HEADING] / (2 * np.pi))
        low, high = self._low.copy(), self._high.copy()
        last = len(low) - STATE_SIZE + HEADING
        low[last] += turn
        high[last] += turn
        motion = np.hstack((guess.states[:-1], guess.commands)).ravel()
        found = self._solver(
            x0=np.concatenate(([guess.duration_s], motion, guess.states[-1])),
            p=state,
            lbx=low,
            ubx=high,
            lbg=self._lower,
            ubg=0.0,
        )
        if not self._solver.stats()["success"]:
            return None
        values = np.asarray(found["x"]).ravel()
        rows = values[1:-STATE_SIZE].reshape(self.intervals, STATE_SIZE + COMMAND_SIZE)
        return Plan(
            duration_s=float(values[0]),
            states=np.vstack((rows[:, :STATE_SIZE], values[-STATE_SIZE:])),
            commands=rows[:, STATE_SIZE:],
            guess=guess.guess,
        )

    def _bounds(self) -> tuple[Array, Array]:
        """Return the bounds on all unknowns for a goal heading of no turn."""
        limits = self.limits
        state = np.full(STATE_SIZE, np.inf)
        state[SWING] = limits.swing_rad
        command = np.array(limits.acceleration_m_s2)
        last = state.copy()
        last[HEADING], last[SWING] = limits.heading_tolerance_rad, limits.swing_tolerance_rad
        motion = np.tile(np.concatenate((state, command)), self.intervals)
        high = np.concatenate(([_LONGEST_S], motion, last))
        low = -high
        low[0] = _SHORTEST_S
        # a start may be beyond the limits; the equalities hold it where it is
        first = slice(1, 1 + STATE_SIZE)
        low[first], high[first] = -np.inf, np.inf
        heights = 1 + 2 + (STATE_SIZE + COMMAND_SIZE) * np.arange(1, self.intervals + 1)
        low[heights] = limits.lowest_m
        return low, high


@lru_cache(maxsize=8)
def problem_for(model: TransportModel, limits: PlanLimits, intervals: int) -> TransportProblem:
    """Return the problem, made once: building it takes longer than solving it."""
    return TransportProblem(model, limits, intervals)


def require_casadi() -> Any:
    """Return the module.

    Raises:
        InstallationError: it is not installed.
    """
    try:
        import casadi
    except ModuleNotFoundError as error:
        raise InstallationError(
            "the package that planning needs",
            error.name,
            "one that is installed",
            "Install it with: pip install 'defmanip_gym[plan]'. Stored plans need none.",
        ) from error
    return casadi
