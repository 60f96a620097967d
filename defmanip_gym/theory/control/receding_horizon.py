"""Transport over a horizon as a quadratic program: swing, speed and acceleration are its limits.

    minimize  Σ_k Δt_k (q_p |p_k − r_k|² + q_v |v_k − ṙ_k|² + q_s |z2_k|² + q_r |ż2_k|² + ρ |w_k|²
                        + q_θ(r_k) (θ_k − θ*_k)²)
    subject to  ‖z2_k‖∞ ≤ σ,  |v_k| ≤ limit,  |w_k| ≤ limit on each axis

over the blocks k of a :class:`~defmanip_gym.theory.control.prediction.Prediction`; the last counts
longer, in place of what comes after it. Headings are those that the last plan leads to, and what
this one changes of them to first order; they count near the goal only, where θ* is the nearest that
the goal allows. The speed limit is a half space where that plan is heading. One slack, dear, keeps
the program feasible where a disturbance has taken the swing out of its limits, and less of it with
every point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.theory.control.horizon import HorizonStart, HorizonWeights
from defmanip_gym.theory.control.prediction import Prediction
from defmanip_gym.theory.control.quadratic_program import daqp_solver
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.frames import turned

_SLACK_COST = 1e3  # per rad and per rad²: more than any way is worth
_FORGIVING_S = 0.3  # about a quarter of a swing, after which a plan is back within its limits
_TINY = 1e-9


class HorizonProgram:
    """The program for any number of episodes.

    Args:
        prediction: of grasp and object.
        weights: of its terms.
        sigma_rad: largest swing.
        acceleration_m_s2: largest acceleration on each axis.
        heading_rad: largest heading at the goal that costs nothing.

    Raises:
        InstallationError: DAQP is not installed.
    """

    def __init__(
        self,
        prediction: Prediction,
        weights: HorizonWeights,
        *,
        sigma_rad: float,
        acceleration_m_s2: float,
        heading_rad: float,
    ) -> None:
        self._solve = daqp_solver("mpc")
        self.prediction, self.weights = prediction, weights
        self.sigma_rad, self.heading_rad = sigma_rad, heading_rad
        blocks, coordinates = len(prediction.times_s), prediction.swing.shape[1] // 2
        self._lasting = prediction.durations_s.copy()
        self._lasting[-1] += weights.terminal_s
        by_time = self._lasting[:, None]
        self._to_position = weights.position * by_time * prediction.position
        self._to_velocity = weights.velocity * by_time * prediction.velocity
        self._planar = (
            prediction.position.T @ self._to_position + prediction.velocity.T @ self._to_velocity
        )
        diagonal = np.repeat((weights.swing, weights.swing_rate), coordinates)
        self._to_swing = diagonal[:, None] * by_time[..., None] * prediction.swing
        self._left = weights.acceleration * np.diag(prediction.durations_s)
        self._forward = self._left + np.einsum("keb,kec->bc", prediction.swing, self._to_swing)
        self._swing_rows = prediction.swing[:, :coordinates].reshape(-1, blocks)
        self._swing_free = prediction.free_swing[:, :coordinates].reshape(-1, 2 * coordinates)
        self._largest = np.append(np.full(2 * blocks, acceleration_m_s2), np.inf)
        self._least = np.append(np.full(2 * blocks, -acceleration_m_s2), 0.0)

    def solve(self, start: HorizonStart) -> tuple[Array, NDArray[np.bool_]]:
        """Return accelerations of the blocks in base axes, (n, M, 2) m/s², and which were found.

        Where none were found they are zero.
        """
        (H, f), (rows, high) = self._cost(start), self._limits(start)
        low = np.concatenate((self._least, np.full(high.shape[1], -np.inf)))
        forward, left = turned(start.plan[..., 0], start.plan[..., 1], -start.headings.middle)
        warm = np.concatenate((forward, left, np.zeros((len(left), 1))), axis=1)
        plan, found = np.zeros_like(start.plan), np.ones(len(warm), dtype=np.bool_)
        for i in range(len(plan)):
            upper = np.concatenate((self._largest, high[i]))
            best, _, flag, _ = self._solve(H[i], f[i], rows[i], upper, low, primal_start=warm[i])
            found[i] = flag > 0
            if found[i]:
                plan[i] = best[:-1].reshape(2, -1).T
        return plan, found

    def _cost(self, start: HorizonStart) -> tuple[Array, Array]:
        """Return H, (n, k, k), and f, (n, k), of (forward, left, slack)."""
        prediction, theta = self.prediction, start.headings.middle
        n, blocks = theta.shape
        between = theta[:, :, None] - theta[:, None, :]
        along, across = self._planar * np.cos(between), self._planar * np.sin(between)
        H, f = np.zeros((n, 2 * blocks + 1, 2 * blocks + 1)), np.zeros((n, 2 * blocks + 1))
        H[:, :blocks, :blocks] = along + self._forward
        H[:, :blocks, blocks:-1] = across
        H[:, blocks:-1, :blocks] = across.transpose(0, 2, 1)
        H[:, blocks:-1, blocks:-1] = along + self._left
        coasting = start.position[:, None] + prediction.times_s[:, None] * start.velocity[:, None]
        pull = np.einsum("kb,nkc->nbc", self._to_position, coasting - start.reference)
        too_fast = start.velocity[:, None] - start.reference_velocity
        pull += np.einsum("kb,nkc->nbc", self._to_velocity, too_fast)
        free = np.einsum("kef,nf->nke", prediction.free_swing, start.swing)
        f[:, :blocks], f[:, blocks:-1] = turned(pull[..., 0], pull[..., 1], -theta)
        f[:, :blocks] += np.einsum("keb,nke->nb", self._to_swing, free)
        rows, errors, weights = self._heading(start)
        weighted = weights[..., None] * rows
        H[:, :-1, :-1] += rows.transpose(0, 2, 1) @ weighted
        f[:, :-1] += np.einsum("nkb,nk->nb", weighted, errors)
        H[:, -1, -1] = f[:, -1] = _SLACK_COST
        return H, f

    def _heading(self, start: HorizonStart) -> tuple[Array, Array, Array]:
        """Return θ per acceleration, (n, M, 2M), its error without any and its weight, (n, M)."""
        middle, end = start.headings.middle, start.headings.end
        between = middle[:, None, :] - middle[:, :, None]
        to_left = np.concatenate((np.sin(between), np.cos(between)), axis=2)
        to_left *= np.tile(self.prediction.mean_velocity, 2)
        change = start.velocity[:, None] - start.headings.mean_velocity
        _, left = turned(change[..., 0], change[..., 1], -middle)
        coasting = end + np.einsum("nkb,nb->nk", start.headings.per_left_speed, left)
        wrapped = np.arctan2(np.sin(end), np.cos(end))
        wanted = end - wrapped + np.clip(wrapped, -self.heading_rad, self.heading_rad)
        square = np.square(start.reference).sum(axis=2)
        near = np.exp(-square / self.weights.heading_radius_m**2)
        weights = self.weights.heading * near * self._lasting
        return start.headings.per_left_speed @ to_left, coasting - wanted, weights

    def _limits(self, start: HorizonStart) -> tuple[Array, Array]:
        """Return rows, (n, rows, k), and their upper bounds, (n, rows): swing, then speed."""
        velocity, theta, swings = start.velocity, start.headings.middle, len(self._swing_rows)
        n, blocks = theta.shape
        rows = np.zeros((n, 2 * swings + blocks, 2 * blocks + 1))
        rows[:, :swings, :blocks] = self._swing_rows
        rows[:, swings : 2 * swings, :blocks] = -self._swing_rows
        forgiven = np.exp(-self.prediction.times_s / _FORGIVING_S)
        rows[:, : 2 * swings, -1] = -np.tile(np.repeat(forgiven, swings // blocks), 2)
        off = start.courses[:, :, None] - theta[:, None, :]
        rows[:, 2 * swings :, :blocks] = self.prediction.velocity * np.cos(off)
        rows[:, 2 * swings :, blocks:-1] = self.prediction.velocity * np.sin(off)
        # not by BLAS, whose last bits depend on the number of episodes
        free = np.einsum("rf,nf->nr", self._swing_free, start.swing)
        along = np.cos(start.courses) * velocity[:, :1] + np.sin(start.courses) * velocity[:, 1:]
        limit = np.maximum(start.speed_limit, np.hypot(velocity[:, 0], velocity[:, 1]) + _TINY)
        bounds = (self.sigma_rad - free, self.sigma_rad + free, limit[:, None] - along)
        return rows, np.concatenate(bounds, axis=1)
