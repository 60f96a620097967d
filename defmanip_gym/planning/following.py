"""Following plans: regulation about each, holding at its end, and telling when one is no use."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.planning.model import HEADING, Array
from defmanip_gym.planning.tracks import Tracks
from defmanip_gym.theory.dynamics.frames import world_to_base

BoolArray = NDArray[np.bool_]
Steps = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Following:
    """The law of whoever follows plans; of each it knows where it begins and how long ago.

    Attributes:
        tracks: where plans and gains come from.
        hold: gain about rest at the goal, (3, 11).
        lost_m: distance from the plan beyond which it is given up.
        patience_samples: after a plan's end, until it is given up.
    """

    tracks: Tracks
    hold: Array
    lost_m: float
    patience_samples: float

    def commands(self, states: Array, origins: Array, steps: Steps) -> Array:
        """Return u_o, (n, 3) m/s²: the plan's with feedback, and beyond its end the holding one.

        Args:
            states: of the reduced model, (n, 11).
            origins: where the plans begin, (n, 11).
            steps: samples since then, (n,).
        """
        w = np.empty((len(states), 3))
        for row, step in enumerate(steps.tolist()):
            now, track = states[row], self.tracks.of(origins[row])
            if step < len(track.commands):
                error = _deviation(now, track.states[step])
                w[row] = track.commands[step] - track.gains[step] @ error
            else:
                error = now.copy()
                error[:3] = world_to_base(now[:3], now[HEADING])
                w[row] = -self.hold @ error
        return w

    def lost(self, states: Array, origins: Array, steps: Steps) -> BoolArray:
        """Return which episodes are far off their plan, or have not ended long after it, (n,)."""
        lost = np.empty(len(states), dtype=np.bool_)
        for row, step in enumerate(steps.tolist()):
            track = self.tracks.of(origins[row])
            if step < len(track.commands):
                away = _deviation(states[row], track.states[step])[:3]
                lost[row] = np.linalg.norm(away) > self.lost_m
            else:
                lost[row] = step - len(track.commands) > self.patience_samples
        return lost


def _deviation(now: Array, planned: Array) -> Array:
    error = now - planned
    error[HEADING] = math.remainder(error[HEADING], math.tau)
    return error
