"""Acceleration limits of one object over conditions and intervals, for each rung of the ladder."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.conditions import (
    EXACT_PARAMETERS,
    CertificateConditions,
    ParameterIntervals,
)
from defmanip_gym.theory.certificates.nonlinear_margin import nonlinear_limit_in_box
from defmanip_gym.theory.certificates.peak_bounds import (
    ellipsoid_bound,
    l1_bound,
    lyapunov_bound,
    tanner_bound,
    tanner_printed_bound,
)
from defmanip_gym.theory.certificates.small_gain import PeakBound, peak_inequality
from defmanip_gym.theory.certificates.worst_case import BoxBound, WorstCase, worst_case
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject

_PEAK_BOUNDS: dict[str, PeakBound] = {
    "tanner_printed": tanner_printed_bound,
    "tanner": tanner_bound,
    "lyapunov": lyapunov_bound,
    "ellipsoid": ellipsoid_bound,
    "l1": l1_bound,
}
SHARED_WITH_SPEED = ("tanner", "tanner_printed")

_MOST_BOXES, _MOST_NONLINEAR_BOXES = 800, 12
_MOST_PHASE_PLANES = 100
PHASE_PLANE = "phase_plane"
CERTIFICATE_METHODS = (*_PEAK_BOUNDS, PHASE_PLANE)


def linear_limit(
    linear: LinearizedObject,
    sigma: float,
    method: str,
    conditions: CertificateConditions,
    intervals: ParameterIntervals,
) -> WorstCase:
    """Return the largest acceleration bound for the linear model over all the intervals."""
    if method in SHARED_WITH_SPEED:
        conditions = replace(conditions, vertical_acceleration_m_s2=0.0)
    at_rest = np.abs(linear.equilibrium)
    if method in SHARED_WITH_SPEED:
        at_rest = np.full_like(at_rest, at_rest.max())  # sup‖z2*‖∞ of Eq. (18)
    budget = sigma - at_rest

    def evaluate(box: ParameterIntervals) -> BoxBound:
        return _box_bound(linear, budget, _PEAK_BOUNDS[method], conditions, box)

    if method == "tanner_printed":  # no certificate anyway: the number for the nominal object
        intervals = EXACT_PARAMETERS
    return worst_case(intervals, evaluate, most_boxes=max(_MOST_BOXES // linear.count, 100))


def _box_bound(
    linear: LinearizedObject,
    budget: Array,
    bound: PeakBound,
    conditions: CertificateConditions,
    box: ParameterIntervals,
) -> BoxBound:
    inequality = peak_inequality(linear, box, conditions, bound)
    if inequality is None:
        return BoxBound(guaranteed=0.0, at_middle=0.0, damping_cost=1.0, stiffness_cost=0.0)
    guaranteed = inequality.acceleration_bound(budget)
    middle = guaranteed
    if box != box.middle:
        exact = peak_inequality(linear, box.middle, conditions, bound)
        middle = 0.0 if exact is None else exact.acceleration_bound(budget)
    return BoxBound(
        guaranteed=guaranteed,
        at_middle=middle,
        damping_cost=inequality.damping_cost,
        stiffness_cost=inequality.stiffness_cost,
    )


@lru_cache(maxsize=64)  # every rung of the ladder asks for the same one
def nonlinear_limit(
    beam: BeamParams,
    sigma: float,
    conditions: CertificateConditions,
    intervals: ParameterIntervals,
) -> float:
    """Return the bound proven for the nonlinear beam over all the intervals."""

    def evaluate(box: ParameterIntervals) -> BoxBound:
        widths = np.ptp((box.damping, box.stiffness), axis=1) / (
            box.middle.damping[0],
            max(box.middle.stiffness[0], 1e-9),
        )
        return BoxBound(
            guaranteed=nonlinear_limit_in_box(beam, sigma, conditions, box),
            at_middle=nonlinear_limit_in_box(beam, sigma, conditions, box.middle),
            damping_cost=float(widths[0]),
            stiffness_cost=float(widths[1]),
        )

    if intervals == EXACT_PARAMETERS:
        return nonlinear_limit_in_box(beam, sigma, conditions, intervals)
    if beam.segment_count == 1:  # there the whole interval of dampings costs nothing
        intervals = replace(intervals, damping=(intervals.damping[0],) * 2)
        return worst_case(intervals, evaluate, most_boxes=_MOST_PHASE_PLANES).bound
    return worst_case(intervals, evaluate, most_boxes=_MOST_NONLINEAR_BOXES).bound
