"""A planned motion: states at the ends of equal intervals, a constant command in each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.planning.model import Array, TransportModel, advanced_rows


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A motion from a start to within the goal's tolerances.

    Attributes:
        duration_s: when it arrives.
        states: (K + 1, 11), in the order of ``model.STATE``.
        commands: w in the base frame, (K, 3) m/s², each for a K-th of the duration.
        guess: what the search began with, in words.
    """

    duration_s: float
    states: Array
    commands: Array
    guess: str

    @property
    def interval_s(self) -> float:
        """Length of an interval."""
        return self.duration_s / len(self.commands)

    def resampled(self, count: int) -> Plan:
        """Return the plan with ``count`` intervals, linear in between: a guess, not a motion."""
        old, new = np.linspace(0, 1, len(self.states)), np.linspace(0, 1, count + 1)
        middles, sought = (old[1:] + old[:-1]) / 2, (new[1:] + new[:-1]) / 2
        return Plan(
            duration_s=self.duration_s,
            states=np.stack([np.interp(new, old, row) for row in self.states.T], axis=-1),
            commands=np.stack([np.interp(sought, middles, row) for row in self.commands.T], -1),
            guess=self.guess,
        )

    def sampled(self, model: TransportModel, period_s: float) -> tuple[Array, Array]:
        """Return states (S + 1, 11) at samples, and the mean command between them, (S, 3).

        The last sample is the first one at which the plan has arrived; from its end on the
        planned state stays as it is.
        """
        count = max(1, int(np.ceil(self.duration_s / period_s - 1e-9)))
        times = np.minimum(np.arange(count + 1) * period_s, self.duration_s)
        interval = np.minimum((times / self.interval_s).astype(int), len(self.commands) - 1)
        rest = times - interval * self.interval_s
        states = advanced_rows(model, self.states[interval], self.commands[interval], rest)
        moved = np.vstack((np.zeros(3), np.cumsum(self.commands, axis=0) * self.interval_s))
        ends = np.linspace(0, self.duration_s, len(moved))
        impulse = np.stack([np.interp(times, ends, row) for row in moved.T], axis=-1)
        return states, np.diff(impulse, axis=0) / period_s
