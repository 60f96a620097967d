"""Where episodes start: sampled, the paper's, or given."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.workspace import in_workspace, workspace_of
from defmanip_gym.errors import StartError
from defmanip_gym.state_tree import fitted, require_drawn
from defmanip_gym.task_params import StartParams, TaskParams
from defmanip_gym.validation import number_array

Array = NDArray[np.float64]
Ids = NDArray[np.intp]

_LARGEST_HEADING_RAD = 100.0  # more turns than that are a slip of the pen

# A draw costs microseconds however long it is, and random forces end episodes after 14 steps.
_STARTS_PER_DRAW = 16

PAPER_START = StartParams().center
_ALLOWED = "'sampled', 'paper', or (x, y, θ, q1, q2, φ)"


def requested_starts(options: Mapping[str, Any] | None, count: int) -> Array | None:
    """Return the starts that reset options ask for, (count, 6), or None for sampled ones.

    Raises:
        StartError: unknown option, or a start that is not six finite numbers (or six for each
            of ``count`` environments).
    """
    if not isinstance(options, Mapping | None):
        raise StartError("options", options, "a dict or None", "Write {'start': ...}.")
    if not options:
        return None
    unknown = set(options) - {"start"}
    if unknown:
        raise StartError(
            "options", sorted(map(str, unknown)), "the key 'start'", f"Use start={_ALLOWED}."
        )
    start = options.get("start", "sampled")
    if isinstance(start, str):
        if start == "sampled":
            return None
        if start == "paper":
            return np.tile(PAPER_START, (count, 1))
        raise StartError("start", start, _ALLOWED, "Check the spelling.")
    values = number_array(start)
    if values is None or values.shape not in ((6,), (count, 6)) or not np.isfinite(values).all():
        raise StartError("start", start, _ALLOWED, "Give six finite numbers in m and rad.")
    return np.broadcast_to(values, (count, 6)).copy()


class StartSampler:
    """Draws starts, uniform within the spread or the ring, for n episodes.

    Args:
        params: center and spread, or distances.
        generators: one for each episode, looked up anew at every draw.
        goal: (x, y, θ, ...) that distances are from.
    """

    def __init__(
        self,
        params: StartParams,
        generators: Sequence[np.random.Generator],
        goal: Sequence[float] = TaskParams().goal,
    ) -> None:
        self._ring, self._goal = params.distance_m, goal
        self._lowest = np.array(params.center) - np.array(params.spread)
        self._width = 2.0 * np.array(params.spread)
        self._generators = generators
        self._drawn = np.zeros((len(generators), _STARTS_PER_DRAW, 6))
        self._used = np.full(len(generators), _STARTS_PER_DRAW)

    def forget(self, ids: Ids) -> None:
        """Draw anew for these episodes, whose generators have been seeded."""
        self._used[ids] = _STARTS_PER_DRAW

    def get_state(self) -> dict[str, Any]:
        """Return what has been drawn, and how much of it is used."""
        return {"drawn": self._drawn.copy(), "used": self._used.copy()}

    def fitting(self, state: Any) -> dict[str, Any]:
        """Return a state for ``set_state``.

        Raises:
            StateError: it is of another number of episodes, or uses more than was drawn.
        """
        fit: dict[str, Any] = fitted("state['starts']", state, self.get_state())
        require_drawn("state['starts']['used']", fit["used"], _STARTS_PER_DRAW)
        return fit

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned."""
        self._drawn[:], self._used[:] = state["drawn"], state["used"]

    def sample(self, ids: Ids) -> Array:
        """Return the next start of each of the episodes ``ids``, (k, 6)."""
        for spent in ids[self._used[ids] == _STARTS_PER_DRAW]:
            self._drawn[spent] = self._generators[spent].random((_STARTS_PER_DRAW, 6))
            self._used[spent] = 0
        starts = self._drawn[ids, self._used[ids]]
        self._used[ids] += 1
        placed: Array = self._lowest + self._width * starts
        if self._ring is not None:
            placed[:, :3] = _on_ring(self._ring, self._goal, starts[:, :3])
        return placed


def extreme_starts(params: StartParams, goal: Sequence[float]) -> Array:
    """Return the corners of the sampled region, (64, 6); of a ring, some of its points."""
    signs = np.array(list(product((-1.0, 1.0), repeat=6)))
    corners: Array = np.array(params.center) + signs * np.array(params.spread)
    if params.distance_m is not None:
        corners[:, :3] = _on_ring(params.distance_m, goal, 0.5 + 0.5 * signs[:, :3])
    return corners


def _on_ring(distance_m: tuple[float, float], goal: Sequence[float], shares: Array) -> Array:
    """Return (x, y, θ) of starts, (k, 3), from shares in [0, 1] of distance, bearing, heading."""
    nearest, farthest = distance_m
    distance = nearest + (farthest - nearest) * shares[:, 0]
    bearing, turn = (math.tau * shares[:, axis] - math.pi for axis in (1, 2))
    x, y, heading = goal[:3]
    return np.column_stack(
        (x + distance * np.cos(bearing), y + distance * np.sin(bearing), heading + turn)
    )


def check_starts(starts: Array, config: TransportConfig) -> None:
    """Raise StartError unless every start (k, 6) lies in the workspace and within σ."""
    upper, fore = starts[:, 3], starts[:, 3] + starts[:, 4]
    inside = in_workspace(starts[:, 0], starts[:, 1], upper, fore, workspace_of(config))
    inside &= np.abs(starts[:, 2]) < _LARGEST_HEADING_RAD
    within = np.abs(config.payload.swung(starts[:, 5])).max(axis=1) <= config.sigma_rad
    for start, reachable, straight in zip(starts, inside, within, strict=True):
        if not reachable:
            raise StartError(
                "start",
                start.tolist(),
                "a pose inside the workspace",
                f"Stay within {config.task.arena_radius_m:g} m of the goal, keep the elbow bent "
                "(-π < q2 < 0) and the grasp above the floor.",
            )
        if not straight:
            raise StartError(
                "start swing",
                float(start[5]),
                f"|φ| <= σ = {config.sigma_rad:.4g} rad",
                "Start within the constraint.",
            )
