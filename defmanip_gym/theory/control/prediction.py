"""Grasp and object over a horizon, linear in accelerations that are held over blocks.

The horizon is cut into M blocks of whole periods. In each the grasp keeps an acceleration in base
axes; what swings the object is its forward part (Eq. (16)), and what it does to the grasp's
position depends on where the base heads meanwhile. The base follows the grasp as a trailer does,
θ̇ = (velocity to the left) / ρ, which for a constant velocity has a solution in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.theory.control.sampled_lqr import sampled
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.towing import towed_heading
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject
from defmanip_gym.validation import require_items, require_whole

# Two seconds of control periods of 20 ms, finer at the beginning.
HORIZON_BLOCKS = (1, 1, 2, 2, 3, 3, 4, 5, 6, 7, 8, 8, 10, 10, 10, 10, 10)

_MOST_PERIODS = 1000
_MOST_BLOCKS = 100


def validated_blocks(name: str, blocks: object) -> tuple[int, ...]:
    """Return the periods of each block, or raise ParameterError."""
    periods = require_items(name, blocks, object)
    require_whole(f"len({name})", len(periods), 1, _MOST_BLOCKS)
    return tuple(require_whole(name, count, 1, _MOST_PERIODS) for count in periods)


@dataclass(frozen=True, kw_only=True)
class HeadingForecast:
    """Headings of n episodes under a plan of M blocks.

    Attributes:
        middle: in the middle of each block, (n, M) rad.
        end: at its end, (n, M) rad.
        mean_velocity: of the grasp in it, (n, M, 2) m/s, in axes that do not turn.
        per_left_speed: change of the heading at each end per change of the speed to the left in
            each block, (n, M, M) rad s/m.
    """

    middle: Array
    end: Array
    mean_velocity: Array
    per_left_speed: Array


class Prediction:
    """What accelerations of blocks do until the end of each block; η = (z2 − z2*, ż2).

    Args:
        linear: the object.
        blocks: periods of each block, (M,).
        period_s: of control.

    Attributes:
        durations_s: of the blocks, (M,).
        times_s: when they end, (M,).
        following: which block's middle lies at that of each block a period later, (M,).
        velocity: per unit of acceleration along a fixed axis, (M, M) s: by end and block.
        mean_velocity: the same for the mean over the block, (M, M) s.
        position: likewise at its end, (M, M) s².
        swing: η per m/s² of forward acceleration, (M, 2N, M).
        free_swing: η per unit of η now, (M, 2N, 2N).
    """

    def __init__(self, linear: LinearizedObject, blocks: tuple[int, ...], period_s: float) -> None:
        ends, count = np.cumsum(blocks), len(blocks)
        starts, horizon = ends - np.array(blocks), int(ends[-1])
        block_of = np.repeat(np.arange(count), blocks)
        spread = (block_of[:, None] == np.arange(count)).astype(np.float64)
        ago = ends[:, None] - np.arange(horizon)  # periods since the start of each period
        is_past = ago > 0
        self.durations_s = period_s * np.array(blocks, dtype=np.float64)
        self.times_s = period_s * ends
        self.following = block_of[np.minimum((starts + ends) // 2 + 1, horizon - 1)]
        self.velocity = (period_s * is_past) @ spread
        self.mean_velocity = self.velocity - 0.5 * np.diag(self.durations_s)
        self.position = (period_s**2 * (ago - 0.5) * is_past) @ spread
        powers, forced = _powers(linear, period_s, horizon)
        response = np.where(is_past[..., None], forced[np.maximum(ago - 1, 0)], 0.0)
        self.swing = np.einsum("kje,jb->keb", response, spread)
        self.free_swing = powers[ends]

    def courses(
        self, heading: Array, velocity: Array, plan: Array, reach: Array
    ) -> HeadingForecast:
        """Return where the base heads under a plan, and what changes of the plan do to that.

        Args:
            heading: now, (n,) rad.
            velocity: of the grasp now, (n, 2) m/s, in axes that do not turn.
            plan: accelerations of the blocks in these axes, (n, M, 2) m/s².
            reach: ρ, (n,) m.
        """
        middle, end = np.empty(plan.shape[:2]), np.empty(plan.shape[:2])
        mean = velocity[:, None] + np.einsum("kb,nbc->nkc", self.mean_velocity, plan)
        for block, duration in enumerate(self.durations_s):
            middle[:, block] = towed_heading(heading, mean[:, block], reach, 0.5 * duration)
            heading = towed_heading(heading, mean[:, block], reach, duration)
            end[:, block] = heading
        # δθ̇ = (δv_left − u1 δθ) / ρ: what a block adds fades with the way that follows it
        forward = np.cos(middle) * mean[..., 0] + np.sin(middle) * mean[..., 1]
        way = np.cumsum(self.durations_s * forward, axis=1) / reach[:, None]
        fading = np.exp(np.minimum(way[:, None, :] - way[:, :, None], 0.0))
        added = np.tril(fading) * self.durations_s / reach[:, None, None]
        return HeadingForecast(middle=middle, end=end, mean_velocity=mean, per_left_speed=added)


def _powers(linear: LinearizedObject, period_s: float, count: int) -> tuple[Array, Array]:
    """Return η after each of ``count`` periods per η, (count + 1, k, k), and per w, (…, k)."""
    A, B = sampled(linear.A_u, linear.forward_input, period_s)
    powers = [np.eye(len(A))]
    for _ in range(count):
        powers.append(A @ powers[-1])
    return np.stack(powers), np.stack(powers) @ B
