"""What a certificate says: its bounds, what they take for granted and what is proven."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams, validated_sigma
from defmanip_gym.theory.certificates.conditions import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.certificates.limits import nonlinear_limit
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject
from defmanip_gym.validation import (
    require_finite_sequence,
    require_params,
    require_positive,
    settle,
)

Proof = Literal["nonlinear", "linear", "none"]
Deformable = BeamParams | LinearizedObject
_Pairs = tuple[tuple[float, float], ...]

# Sampled feedback linearization overshoots a rate by a fraction of a percent.
_COMMANDED_YAW_SHARE = 0.98


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Bounds on the commanded grasp motion that keep ‖z2‖∞ ≤ σ.

    Attributes:
        method: key of the method in ``theory.certificates``.
        sigma_rad: σ of Eq. (9).
        deformable: the object it was computed for.
        nu_max: the bound on sup‖ν‖∞ before it is shared between speed and acceleration, m/s².
        acceleration_bound: largest commanded forward acceleration, m/s²; for objects that sideways
            acceleration deforms, on each horizontal axis.
        speed_bound: largest grasp speed, m/s; infinite where speed does not deform the object.
        conditions: what it takes for granted, enforced by ``NuMaxActionScaling``.
        intervals: factors on damping and stiffness for which it holds.
        worst_factors: the (damping, stiffness) factors where the bound is smallest.
    """

    method: str
    sigma_rad: float
    deformable: Deformable
    nu_max: float
    acceleration_bound: float
    speed_bound: float
    conditions: CertificateConditions
    intervals: ParameterIntervals
    worst_factors: tuple[float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigma_rad", validated_sigma(self.sigma_rad))
        settle(self, "deformable", _require_deformable)
        settle(self, "conditions", require_params, CertificateConditions)
        settle(self, "intervals", require_params, ParameterIntervals)
        settle(self, "worst_factors", require_finite_sequence, 2)

    @property
    def coordinate_count(self) -> int:
        """Number N of internal coordinates of its object."""
        if isinstance(self.deformable, BeamParams):
            return self.deformable.segment_count
        return self.deformable.count

    def covers(self, beam: BeamParams) -> bool:
        """Whether it holds for this beam: the certified one within the intervals.

        More damping than certified never hurts a single hinge, whose phase plane shows it.
        """
        certified = self.deformable
        if not isinstance(certified, BeamParams):
            return False
        if beam.segment_count == certified.segment_count == 1:
            low, high = self.intervals.damping[0], math.inf
            dampings: _Pairs = ((beam.damping, certified.damping),)
            stiffnesses: _Pairs = ((beam.root_stiffness, certified.root_stiffness),)
        else:
            low, high = self.intervals.damping
            dampings = (
                (beam.damping, certified.damping),
                (beam.joint_damping, certified.joint_damping),
            )
            stiffnesses = (
                (beam.root_stiffness, certified.root_stiffness),
                (beam.joint_stiffness, certified.joint_stiffness),
            )
        same_rods = certified == replace(
            beam,
            damping=certified.damping,
            joint_damping=certified.joint_damping,
            root_stiffness=certified.root_stiffness,
            joint_stiffness=certified.joint_stiffness,
        )
        return (
            same_rods
            and _share_a_factor(dampings, low, high)
            and _share_a_factor(stiffnesses, *self.intervals.stiffness)
        )

    @property
    def resulting_acceleration(self) -> float:
        """Largest forward acceleration that the object may meet: the bound plus its error, m/s²."""
        return self.acceleration_bound + self.conditions.acceleration_error_m_s2

    @property
    def vertical_acceleration_bound(self) -> float:
        """Largest commanded vertical acceleration, m/s²."""
        conditions = self.conditions
        return max(conditions.vertical_acceleration_m_s2 - conditions.vertical_error_m_s2, 0.0)

    @property
    def commanded_yaw_rate_rad_s(self) -> float:
        """Largest yaw rate that is asked for; a sampled robot overshoots it."""
        return _COMMANDED_YAW_SHARE * self.conditions.yaw_rate_rad_s

    @cached_property
    def nonlinear_limit(self) -> float | None:
        """Acceleration bound, m/s², proven for the nonlinear object under the same conditions.

        ``None`` where only the linearization is known. Exact for one hinge; beyond, the proof is
        conservative, and a certificate above it rests on the linear model and on attacks.
        """
        if not isinstance(self.deformable, BeamParams):
            return None
        return nonlinear_limit(self.deformable, self.sigma_rad, self.conditions, self.intervals)

    @property
    def proof(self) -> Proof:
        """For which model of the object the bound is proven."""
        if self.method == "tanner_printed":
            return "none"
        limit = self.nonlinear_limit
        is_within = limit is not None and self.resulting_acceleration <= limit
        return "nonlinear" if is_within else "linear"

    @property
    def is_proven(self) -> bool:
        """Whether a proof, for the linearized object at least, stands behind it.

        ``proof`` says for which: one for the linear object alone has been broken by attacks.
        """
        return self.proof != "none"

    def lowered(self, acceleration_bound_m_s2: float) -> Certificate:
        """Return the same promise for a smaller acceleration bound.

        Raises:
            ParameterError: not a bound > 0 that is at most the certified one.
        """
        acceleration_bound_m_s2 = require_positive(
            "acceleration_bound_m_s2", acceleration_bound_m_s2, "m/s²"
        )
        if acceleration_bound_m_s2 > self.acceleration_bound:
            raise ParameterError(
                "acceleration_bound_m_s2",
                acceleration_bound_m_s2,
                f"at most {self.acceleration_bound:.4g}, what is certified",
                "A certificate says nothing about larger accelerations.",
            )
        lost = self.acceleration_bound - acceleration_bound_m_s2
        return replace(
            self,
            nu_max=self.nu_max - lost,
            acceleration_bound=acceleration_bound_m_s2,
        )

    def proven(self) -> Certificate:
        """Return the certificate, lowered to what is proven for the nonlinear object.

        Raises:
            CertificateError: nothing is, under these conditions.
        """
        if self.proof == "nonlinear":
            return self
        limit = self.nonlinear_limit or 0.0
        bound = limit - self.conditions.acceleration_error_m_s2
        if self.proof == "none" or bound <= 0:
            raise CertificateError(
                "nonlinear_limit",
                limit,
                f"a limit above {self.conditions.acceleration_error_m_s2:g} m/s², the room for "
                "errors, and a method that is a certificate",
                "Ask for less in the conditions, or for a smaller σ.",
            )
        return self.lowered(bound)


def _require_deformable(name: str, value: object) -> Deformable:
    """Return a beam or a linearized object, or what the mapping of either's fields makes."""
    is_linearized = isinstance(value, LinearizedObject) or (
        isinstance(value, Mapping) and "equilibrium" in value
    )
    if is_linearized:
        return require_params(name, value, LinearizedObject)
    return require_params(name, value, BeamParams)


def _share_a_factor(pairs: _Pairs, low: float, high: float) -> bool:
    """Whether one factor within [low, high] turns every second number into the first."""
    factors = [true / certified for true, certified in pairs if certified > 0]
    nothing_new = all(true == 0 for true, certified in pairs if certified == 0)
    rounding = 1e-9
    return nothing_new and all(
        low - rounding <= factor <= high + rounding and abs(factor - factors[0]) <= rounding
        for factor in factors
    )
