"""Improving a plan on the plant: Frank–Wolfe steps along the adjoint's gradient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defmanip_gym.attack.adjoint import Adjoint
from defmanip_gym.attack.plans import Outcome, Plan, Proving
from defmanip_gym.attack.target import UP, YAW, InputLimits
from defmanip_gym.theory.dynamics.chain import Array

_STEP_LENGTHS = (1.0, 0.5, 0.25)
_FLIPPED_SHARES = (0.5, 0.75, 0.9)
_LEAST_GAIN = 1e-3


def climb(
    proving: Proving,
    adjoint: Adjoint,
    outcome: Outcome,
    limits: InputLimits,
    *,
    iterations: int,
) -> Outcome:
    """Improve a plan until it no longer gains, and return the best one.

    The gradient's signs are the worst inputs for the plant linearized along the plan. Since they
    move the plan, and with it the linearization, candidates go only part of the way: all inputs by
    a share, or only those fully on which the gradient is surest.

    Args:
        proving: where plans are tried.
        adjoint: gradients on the same plant.
        outcome: the plan to improve, cut off at its peak.
        limits: of the inputs.
        iterations: at most.
    """
    for _ in range(iterations):
        plan = outcome.plan
        gradient, start_gradient = adjoint.gradient(
            plan.shares * limits.inputs,
            proving.initial(plan.start, limits),
            coordinate=outcome.coordinate,
            turning_rad_s=limits.yaw_rate_rad_s,
        )
        gradient, start_gradient = outcome.sign * gradient, outcome.sign * start_gradient
        best = proving.outcomes(_neighbours(plan, gradient, start_gradient), limits)[0]
        gain = best.peak / outcome.peak - 1
        if gain > 0:
            outcome = best
        if gain < _LEAST_GAIN:
            break
    return outcome


def _neighbours(plan: Plan, gradient: Array, start_gradient: Array) -> list[Plan]:
    worst = np.sign(gradient)
    worst[:, YAW] = gradient[:, YAW] > 0
    size = np.abs(gradient)
    plan = replace(plan, start=np.sign(start_gradient), name="adjoint ascent")
    candidates = [
        replace(plan, shares=plan.shares + length * (worst - plan.shares))
        for length in _STEP_LENGTHS
    ]
    for share in _FLIPPED_SHARES:
        # of each input on its own: their gradients have different units
        sure = size >= np.quantile(size, share, axis=0)
        candidates.append(replace(plan, shares=np.where(sure, worst, plan.shares)))
    only_forward = plan.shares.copy()
    only_forward[:, :UP] = worst[:, :UP]
    candidates.append(replace(plan, shares=only_forward))
    return candidates
