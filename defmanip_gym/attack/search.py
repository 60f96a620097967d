"""The attack: the largest deformation within a certificate, and the smallest bound that fails."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np

from defmanip_gym.attack.adjoint import Adjoint
from defmanip_gym.attack.ascent import climb
from defmanip_gym.attack.crossing import ACCURACY, smallest_crossing
from defmanip_gym.attack.plans import Outcome, Plan, Proving
from defmanip_gym.attack.result import AttackResult
from defmanip_gym.attack.switching import FeedbackLaw, modal_laws, worst_switching
from defmanip_gym.attack.target import InputLimits, PlantFactors, Target
from defmanip_gym.theory.certificates.peak_bounds import l1_bound
from defmanip_gym.theory.dynamics.chain import Array

_DECAYED_TO, _LEAST_SWINGS = 0.01, 1.5
_STRETCHES = (1.0, 1.01, 1.02, 1.03)
_AT_ONCE = 8
# shares of the slowest mode's period / 2π: how late feedback reacts, how long one linearization
# along a trajectory serves
_REACTION, _LINEARIZED = 0.05, 0.1


def attack(
    target: Target,
    limits: InputLimits,
    *,
    sigma: float,
    acceleration_error: float = 0.0,
    plants: Sequence[PlantFactors] = (PlantFactors(),),
    longest_s: float = 60.0,
    iterations: int = 4,
    num_threads: int = 0,
) -> AttackResult:
    """Search for the worst admissible input and for the smallest bound at which it violates σ.

    Args:
        target: the object.
        limits: what the certificate allows; its forward acceleration is what the search varies.
        sigma: admissible |z2|.
        acceleration_error: part of ``limits.forward_m_s2`` that is not the certified bound.
        plants: plants to try; the search goes on with the one that deforms most.
        longest_s: longest attack; shorter where free motion has decayed to 1 % before.
        iterations: steps of adjoint ascent at each level; 0 leaves it out.
        num_threads: of the plant, 0 for one per CPU.
    """
    began = time.process_time()
    searches = [
        _Search(target.varied(plant), limits, sigma, longest_s, iterations, num_threads)
        for plant in plants
    ]
    firsts = [search.first() for search in searches]
    worst = int(np.argmax([first.peak for first in firsts]))
    search = searches[worst]
    at_bound = search.improved(firsts[worst], limits)
    factor, breaking = search.smallest_violation(at_bound)
    reached = max(at_bound.peak, search.proving.outcomes([breaking.plan], limits)[0].peak)
    shown = limits.scaled(factor) if math.isfinite(factor) else limits
    return AttackResult(
        sigma=sigma,
        certified_bound=limits.forward_m_s2 - acceleration_error,
        peak_at_bound=reached,
        violating_bound=factor * limits.forward_m_s2 - acceleration_error,
        method=breaking.plan.name,
        coordinate=target.linear.coordinates[breaking.coordinate],
        limits=shown,
        inputs=breaking.plan.shares * shown.inputs,
        start=search.proving.initial(breaking.plan.start, limits),
        timestep_s=target.timestep_s,
        plant=plants[worst],
        cpu_seconds=time.process_time() - began,
    )


class _Search:
    """The search on one plant."""

    def __init__(
        self,
        target: Target,
        limits: InputLimits,
        sigma: float,
        longest_s: float,
        iterations: int,
        num_threads: int,
    ) -> None:
        self.target, self.limits, self.sigma = target, limits, sigma
        self.has_one_hinge = target.linear.count == 1
        # for one hinge feedback is the worst input there is
        self.iterations = 0 if self.has_one_hinge else iterations
        decayed_s = -math.log(_DECAYED_TO) / target.slowest_decay_per_s
        swings_s = _LEAST_SWINGS * 2 * math.pi / target.slowest_speed_rad_s
        self.horizon_s = min(longest_s, max(decayed_s, swings_s))
        self.proving = Proving(target, count=_AT_ONCE, num_threads=num_threads)
        steps_per_radian = 1 / target.slowest_speed_rad_s / target.timestep_s
        self.hold_steps = max(1, int(_REACTION * steps_per_radian))
        self.adjoint = Adjoint(target.rig, stride=max(1, int(_LINEARIZED * steps_per_radian)))
        self.laws = modal_laws(target.linear, count=_AT_ONCE)
        self.law = 0

    def first(self) -> Outcome:
        """Return the best plan that needs no search."""
        outcomes = self._feedback([self.limits] * _AT_ONCE, self.laws)
        self.law = int(np.argmax([outcome.peak for outcome in outcomes]))
        best = outcomes[self.law]
        if not self.has_one_hinge:
            switched = self.proving.outcomes(self._switching(), self.limits)[0]
            best = max(best, switched, key=lambda outcome: outcome.peak)
        return best

    def improved(self, outcome: Outcome, limits: InputLimits) -> Outcome:
        """Return the plan after adjoint ascent."""
        return climb(self.proving, self.adjoint, outcome, limits, iterations=self.iterations)

    def smallest_violation(self, outcome: Outcome) -> tuple[float, Outcome]:
        """Return the smallest factor on the limits found at which |z2| > σ, and the plan."""
        guess = self.sigma / outcome.peak
        found, best = self._scaled(outcome, guess), outcome
        factor, retuned = self._retuned(guess)
        if retuned is not None and factor < found:
            found, best = factor, retuned
        for _ in range(self.iterations):
            if math.isinf(found):
                break
            better = self.improved(best, self.limits.scaled(found))
            lower = self._scaled(better, found * self.sigma / better.peak)
            if not lower < found * (1 - ACCURACY / 2):
                break
            found, best = lower, better
        return found, best

    def _retuned(self, guess: float) -> tuple[float, Outcome | None]:
        """Return the smallest factor at which feedback, reacting to the motion, violates σ."""
        law = self.laws.repeated(self.law, _AT_ONCE)
        runs: dict[float, Outcome] = {}

        def peaks(factors: Array) -> Array:
            outcomes = self._feedback(self._limits(factors), law)
            runs.update(zip(factors.tolist(), outcomes, strict=True))
            return np.array([each.peak for each in outcomes])

        factor = smallest_crossing(peaks, self.sigma, guess=guess, count=_AT_ONCE)
        return factor, runs.get(factor)

    def _scaled(self, outcome: Outcome, guess: float) -> float:
        """Return the smallest factor at which a plan, otherwise unchanged, violates σ."""

        def peaks(factors: Array) -> Array:
            return self.proving.peaks(outcome.plan, self._limits(factors))

        return smallest_crossing(peaks, self.sigma, guess=guess, count=_AT_ONCE)

    def _limits(self, factors: Array) -> list[InputLimits]:
        return [self.limits.scaled(float(factor)) for factor in factors]

    def _feedback(self, limits: list[InputLimits], laws: FeedbackLaw) -> list[Outcome]:
        return self.proving.feedback(
            laws,
            limits,
            duration_s=self.horizon_s,
            hold_steps=self.hold_steps,
            name="modal feedback",
        )

    def _switching(self) -> list[Plan]:
        steps = round(self.horizon_s / self.target.timestep_s)
        # those that the linear object is driven farthest in
        reach = l1_bound(self.target.linear)[: self.target.linear.count]
        coordinates = np.argsort(reach)[-2:]
        plans = []
        for coordinate in coordinates.tolist():
            for stretch in _STRETCHES:
                shares, start = worst_switching(
                    self.target.linear,
                    coordinate=coordinate,
                    steps=steps,
                    timestep_s=self.target.timestep_s,
                    stretch=stretch,
                )
                plans.append(Plan(name="linear switching", shares=shares, start=start))
        return plans
