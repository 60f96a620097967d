"""Plans: input sequences in shares of their limits, and how far they drive the plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from defmanip_gym.attack.switching import FeedbackLaw
from defmanip_gym.attack.target import InputLimits, Target
from defmanip_gym.plant.object_rig import ObjectRig, Shaking
from defmanip_gym.theory.dynamics.chain import Array


@dataclass(frozen=True, kw_only=True)
class Plan:
    """One attack, independent of how large the inputs may be.

    Attributes:
        name: the family of attacks it comes from.
        shares: (steps, 4), inputs divided by their limits.
        start: (2N,), η at the start divided by its limits.
    """

    name: str
    shares: Array
    start: Array


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How far a plan drives the plant.

    Attributes:
        plan: the plan, cut off where the deformation is largest.
        peak: largest |z2|.
        coordinate: index of the coordinate that reaches it.
        sign: on which side.
    """

    plan: Plan
    peak: float
    coordinate: int
    sign: float


class Proving:
    """Runs plans and feedback laws on a fixed number of copies of the plant.

    Args:
        target: the object.
        count: plans that run at once.
        num_threads: 0 for one per CPU.
    """

    def __init__(self, target: Target, *, count: int, num_threads: int = 0) -> None:
        self.target, self.count = target, count
        self._rig = ObjectRig(target.rig, count=count, num_threads=num_threads)

    def initial(self, start: Array, limits: InputLimits) -> Array:
        """Return (z2, ż2) for a start in shares of its limits, (..., 2N)."""
        n = self.target.linear.count
        scale = np.repeat([limits.start, limits.start_rate], n)
        rest = np.concatenate((self.target.rig.equilibrium, np.zeros(n)))
        return np.asarray(rest + scale * start)

    def outcomes(self, plans: Sequence[Plan], limits: InputLimits) -> list[Outcome]:
        """Play plans of one length; the best first."""
        results: list[Outcome] = []
        for begin in range(0, len(plans), self.count):
            chunk = list(plans[begin : begin + self.count])
            padded = chunk + chunk[:1] * (self.count - len(chunk))
            self._place(np.stack([plan.start for plan in padded]), limits)
            shares = np.stack([plan.shares for plan in padded])
            shaking = self._rig.play(shares * limits.inputs, record=True)
            results += [self._outcome(plan, shaking, row) for row, plan in enumerate(chunk)]
        return sorted(results, key=lambda outcome: -outcome.peak)

    def peaks(self, plan: Plan, limits: Sequence[InputLimits]) -> Array:
        """Return max |z2| of one plan under ``count`` different limits, (count,)."""
        self._place(np.tile(plan.start, (self.count, 1)), limits)
        scale = np.stack([limit.inputs for limit in limits])
        shaking = self._rig.play(plan.shares[None], scale=scale)
        return _valid_peaks(shaking)

    def feedback(
        self,
        law: FeedbackLaw,
        limits: Sequence[InputLimits],
        *,
        duration_s: float,
        hold_steps: int,
        name: str,
    ) -> list[Outcome]:
        """Let feedback laws shake the plant, one per simulation, and return them as plans."""
        inputs = np.stack([limit.inputs for limit in limits])
        start = np.sign(np.hstack((law.p, law.p)))
        self._place(start, limits)
        shaking = self._rig.shake(
            law.command(inputs), duration_s=duration_s, hold_steps=hold_steps, record=True
        )
        assert shaking.inputs is not None
        # limits of 0 leave inputs at 0
        shares = shaking.inputs / np.where(inputs > 0, inputs, 1.0)[:, None, :]
        return [
            self._outcome(Plan(name=name, shares=shares[row], start=start[row]), shaking, row)
            for row in range(self.count)
        ]

    def _place(self, start: Array, limits: InputLimits | Sequence[InputLimits]) -> None:
        each = [limits] * self.count if isinstance(limits, InputLimits) else limits
        states = np.stack([self.initial(start[row], limit) for row, limit in enumerate(each)])
        n = self.target.linear.count
        self._rig.place(states[:, :n], states[:, n:])

    def _outcome(self, plan: Plan, shaking: Shaking, row: int) -> Outcome:
        assert shaking.z2 is not None
        if shaking.diverged[row]:
            return Outcome(plan=plan, peak=0.0, coordinate=0, sign=1.0)
        z2 = shaking.z2[row]
        step, coordinate = np.unravel_index(np.abs(z2).argmax(), z2.shape)
        hold = len(plan.shares) // len(z2)
        return Outcome(
            plan=replace(plan, shares=plan.shares[: (int(step) + 1) * hold]),
            peak=float(shaking.peak[row].max()),
            coordinate=int(coordinate),
            sign=float(np.sign(z2[step, coordinate])),
        )


def _valid_peaks(shaking: Shaking) -> Array:
    return np.where(shaking.diverged, 0.0, shaking.peak.max(axis=1))
