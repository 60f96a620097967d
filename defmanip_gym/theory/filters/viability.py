"""How much of what is possible at all a filter allows: the viable set of one hinge, a yardstick.

The largest set of (φ, φ̇, v) within |φ| ≤ σ, |v| ≤ v_max in which some |a| ≤ a_max, held for a
period at a time, stays for ever. What stays has to turn, and where it turns, within σ, it stores at
most V_σ, so that coasting stays from there. So a state is viable just where its present half swing
can be stopped by σ: for φ̇ > 0 up to a rate R(φ, v) that falls with v, for φ̇ < 0 up to R(−φ, −v).

R is bounded from outside by any a(t), held or not (Bellman's equation with φ as time), and from
within by held policies that are simulated: run up away from the speed limit, then brake hardest.
Derivation: docs/derivations.md, section 20.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from defmanip_gym.compiled import without_garbage_collection
from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams, validated_sigma
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.safety_filter import BoolArray
from defmanip_gym.theory.filters.viability_bounds import (
    Hinge,
    inner_energy,
    outer_energy,
    potential,
)
from defmanip_gym.validation import require_params

_CELLS = 64  # of φ and of v, where R is kept
_FINER = 8  # cells of the outer bound in each of those; half as many tell its error
_TURN = 0.1  # largest phase of a step of integration, rad
_MOST_SUBSTEPS = 100
_MOST_PERIODS = 160  # in a half swing


class Bounds(NamedTuple):
    """What a number is at least and at most."""

    low: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ViableSet:
    """The viable set of one hinge between an inner and an outer bound.

    Attributes:
        beam: that hangs from the hinge.
        sigma_rad: σ.
        task: its limits of acceleration and speed, and its control period.
        swing: φ, (P,) rad, denser towards ±σ.
        speed: v, (Q,) m/s.
        inner: rates φ̇ ≥ 0 from which a simulated policy stays within σ, (P, Q) rad/s.
        outer: rates above which none can, (P, Q) rad/s.
    """

    beam: BeamParams
    sigma_rad: float
    task: TaskParams
    swing: Array
    speed: Array
    inner: Array
    outer: Array

    @property
    def volume(self) -> Bounds:
        """Volume of the set, rad · rad/s · m/s."""
        return Bounds(*(float(np.trapezoid(self._areas(rate), self.speed)) for rate in self._rates))

    @property
    def error(self) -> float:
        """By which share of the outer volume the bounds differ."""
        return 1 - self.volume.low / self.volume.high

    def area(self, speed_m_s: float) -> Bounds:
        """Return the area of its cut at one speed, rad · rad/s; 0 beyond the speed limit."""
        if abs(speed_m_s) > self.task.max_speed_m_s:
            return Bounds(0.0, 0.0)
        areas = (self._areas(rate) for rate in self._rates)
        return Bounds(*(float(np.interp(speed_m_s, self.speed, area)) for area in areas))

    def margin(self, swing_rad: Any, swing_rate_rad_s: Any, speed_m_s: Any) -> Array:
        """Return by how much the hinge might swing faster, (...) rad/s, by the inner bound.

        Args:
            swing_rad: φ, (...).
            swing_rate_rad_s: φ̇, (...).
            speed_m_s: of the grasp, (...).

        Returns:
            Negative outside, −inf beyond σ or the speed limit.
        """
        return self._distance(self.inner, swing_rad, swing_rate_rad_s, speed_m_s)

    def contains(self, swing_rad: Any, swing_rate_rad_s: Any, speed_m_s: Any) -> BoolArray:
        """Whether states, (...), are viable for sure: within the inner bound."""
        inside: BoolArray = self.margin(swing_rad, swing_rate_rad_s, speed_m_s) >= 0.0
        return inside

    def excludes(self, swing_rad: Any, swing_rate_rad_s: Any, speed_m_s: Any) -> BoolArray:
        """Whether states, (...), are lost for sure: beyond the outer bound."""
        outside: BoolArray = (
            self._distance(self.outer, swing_rad, swing_rate_rad_s, speed_m_s) < 0.0
        )
        return outside

    @property
    def _rates(self) -> tuple[Array, Array]:
        return self.inner, self.outer

    def _areas(self, rate: Array) -> Array:
        """Return the area at each speed; φ = −σ cos ϑ, in which R is smooth at ±σ."""
        lean = np.sqrt(np.maximum(self.sigma_rad**2 - self.swing**2, 0.0))
        half = math.pi / (len(self.swing) - 1) * (lean @ rate)
        return half + half[::-1]

    def _distance(self, rates: Array, swing: Any, swing_rate: Any, speed: Any) -> Array:
        phi, rate, v = np.broadcast_arrays(
            *(np.asarray(each, dtype=np.float64) for each in (swing, swing_rate, speed))
        )
        outward = np.where(rate < 0, -1.0, 1.0)
        # φ̇² is as good as linear where φ̇ falls to zero; outside there is no such rate
        square = RegularGridInterpolator(
            (self.swing, self.speed), rates**2, bounds_error=False, fill_value=-1.0
        )(np.stack((outward * phi, outward * v), axis=-1))
        return np.where(square < 0, -np.inf, np.sqrt(np.maximum(square, 0.0)) - np.abs(rate))


def viable_set(
    beam: BeamParams = BeamParams(),
    *,
    sigma_rad: float = math.pi / 6,
    task: TaskParams = TaskParams(),
) -> ViableSet:
    """Return the viable set of a beam of one segment.

    Args:
        beam: with any damping and root stiffness.
        sigma_rad: σ.
        task: its limits of acceleration and speed, and its control period.

    Raises:
        CertificateError: a beam with several segments.
        ParameterError: swings that are too fast or too slow for the control period.
    """
    beam = require_params("beam", beam, BeamParams)
    task = require_params("task", task, TaskParams)
    sigma_rad = validated_sigma(sigma_rad)
    if beam.segment_count != 1:
        raise CertificateError(
            "segment_count of a viable set",
            beam.segment_count,
            "1",
            "Its dimensions would be too many for a grid: take storage's set or the backup's.",
        )
    hinge, periods = _discretized(beam, sigma_rad, task)
    with without_garbage_collection():
        coarse = _outer(hinge, _FINER // 2)
        fine = _outer(hinge, _FINER)
        # the scheme is of the first order, so what is left is about what halving cells has changed
        outer = fine + 2 * np.maximum(fine - coarse, 0.0)
        swing, speed, inner = _swings(hinge, 1), _speeds(hinge, 1), np.zeros_like(outer)
        inner_energy(hinge, swing, speed, periods, outer, inner)
    return ViableSet(
        beam=beam,
        sigma_rad=sigma_rad,
        task=task,
        swing=swing,
        speed=speed,
        inner=np.sqrt(2 * inner),
        outer=np.sqrt(2 * outer),
    )


def _discretized(beam: BeamParams, sigma: float, task: TaskParams) -> tuple[Hinge, int]:
    """Return the hinge with its steps of integration, and periods enough for a half swing."""
    hinge, period_s = Hinge.of(beam, sigma, task, 1), task.control_period_s
    edge = 2 * potential(hinge, sigma) / sigma**2  # ω², of the slowest of its swings
    fastest = math.sqrt(edge * 1.5 + hinge.pull * task.max_acceleration_m_s2) + hinge.damping
    substeps = max(math.ceil(period_s * fastest / _TURN), 2)
    periods = math.ceil(1.5 * math.pi / math.sqrt(edge) / period_s) + 2
    if substeps > _MOST_SUBSTEPS or periods > _MOST_PERIODS:
        raise ParameterError(
            "control periods in a half swing",
            math.pi / math.sqrt(edge) / period_s,
            f"at most about {_MOST_PERIODS / 1.5:.0f}, and swing and damping not faster than "
            f"{_MOST_SUBSTEPS * _TURN:g} rad a period",
            "Choose another control_period_s, or a beam that swings at another rate.",
        )
    return hinge._replace(substeps=substeps), periods


def _swings(hinge: Hinge, finer: int) -> Array:
    cells = _CELLS * finer
    swing = -hinge.sigma * np.cos(np.pi * np.arange(cells + 1) / cells)
    swing[cells // 2] = 0.0
    return swing


def _speeds(hinge: Hinge, finer: int) -> Array:
    return np.linspace(-hinge.speed, hinge.speed, _CELLS * finer + 1)


def _outer(hinge: Hinge, finer: int) -> Array:
    swing = _swings(hinge, finer)
    energy = np.zeros((len(swing), len(swing)))
    outer_energy(hinge, swing, energy)
    return np.ascontiguousarray(energy[::finer, ::finer])
