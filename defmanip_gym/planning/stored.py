"""Plans that were made once: optimal times, and plans to be driven, by start."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from defmanip_gym.planning.model import HEADING, STATE_SIZE, SWING, SWING_RATE, Array
from defmanip_gym.planning.plan import Plan

_ALIKE = 1e-4  # m and rad: starts closer than that are one
_ALIKE_STATE = 2e-3  # and states, which are stored in steps


@dataclass(frozen=True, kw_only=True)
class StoredPlan:
    """What is known of a start.

    Attributes:
        start: (x, y, θ, q1, q2, φ), m and rad.
        optimum_s: T*, without margins.
        optimal_guess: what led to it.
        drive: a plan with margins.
    """

    start: tuple[float, ...]
    optimum_s: float
    optimal_guess: str
    drive: Plan


@dataclass(frozen=True, kw_only=True)
class StoredPlans:
    """Plans by start.

    Attributes:
        made_with: model, limits and programs that they were made with, as JSON values.
        plans: one a start.
    """

    made_with: Mapping[str, Any]
    plans: tuple[StoredPlan, ...] = ()

    def find(self, start: Sequence[float]) -> StoredPlan | None:
        """Return what is known of a start (x, y, θ, q1, q2, φ); None where nothing is."""
        return self._nearest(self.starts - np.asarray(start), _ALIKE)

    def find_state(self, state: Array, *, swing_tolerance_rad: float) -> StoredPlan | None:
        """Return what is known of a planner's state, (11,); None where nothing is.

        Args:
            state: in the order of ``model.STATE``; the heading may have any number of turns.
            swing_tolerance_rad: by how much swing and its rate, which noisy sensors tell, may
                differ.
        """
        away = self._states - state
        away[:, HEADING] = np.remainder(away[:, HEADING] + np.pi, 2 * np.pi) - np.pi
        away[:, [SWING, SWING_RATE]] *= _ALIKE_STATE / swing_tolerance_rad
        return self._nearest(away, _ALIKE_STATE)

    def including(self, plan: StoredPlan) -> StoredPlans:
        """Return these and one more, in place of an old one of the same start."""
        others = tuple(old for old in self.plans if old.start != plan.start)
        return replace(self, plans=(*others, plan))

    @property
    def digest(self) -> str:
        """SHA-256 of the plans."""
        content = hashlib.sha256()
        for plan in self.plans:
            content.update(np.array([*plan.start, plan.optimum_s, plan.drive.duration_s]).tobytes())
            content.update(plan.drive.states.tobytes() + plan.drive.commands.tobytes())
        return content.hexdigest()

    def _nearest(self, away: Array, tolerance: float) -> StoredPlan | None:
        if not self.plans:
            return None
        largest = np.abs(away).max(axis=1)
        nearest = int(np.argmin(largest))
        return self.plans[nearest] if largest[nearest] < tolerance else None

    @cached_property
    def _states(self) -> Array:
        return np.array([plan.drive.states[0] for plan in self.plans]).reshape(-1, STATE_SIZE)

    @cached_property
    def starts(self) -> Array:
        """All starts, (n, 6)."""
        return np.array([plan.start for plan in self.plans]).reshape(-1, 6)
