"""How much of a bound is proven for the nonlinear beam, not just for its linearization.

One hinge: exactly, in the phase plane. More segments: the nonlinear terms of Eq. (6b) enter the
linear object as torques whose size is bounded by the peaks of |z2|, |ż2|, |z̈2| and of the bends so
far,

    R = H (1 − cos δ) |z̈2| + H |sin δ| ż2² + g S |γ φ − sin φ| + S |c − cos φ| ā
        + u2² |Γ_ω| (|φ_k| − sin|φ_k| cos φ_j),

δ_jk the bend |φ_j − φ_k| between two segments, H the inertial coupling and S the first moments. The
linear object has γ times the gravity stiffness and c times the input of the real one: 1 each, or
the middle of what sin φ / φ and cos φ are within σ. Peaks that satisfy p = β + c g ā + Θ p + T R(p)
cannot be exceeded (docs/derivations.md, section 5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.certificates.conditions import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.certificates.impulse_response import peak_free_response, peak_gains
from defmanip_gym.theory.certificates.phase_plane import one_hinge_limit
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, is_hurwitz, linearize

_BISECTIONS = 25
_ITERATIONS = 300
_MARGIN = 1e-4
_COARSE = 64  # samples per period: errors of a thousandth, rounded up, do no harm


def nonlinear_limit_in_box(
    beam: BeamParams,
    sigma_rad: float,
    conditions: CertificateConditions,
    box: ParameterIntervals,
) -> float:
    """Return an acceleration bound (m/s²) proven for the nonlinear beam; 0 if none was found."""
    if beam.segment_count == 1:
        return one_hinge_limit(beam, sigma_rad, conditions, box)
    return max(
        _peak_limit(beam, sigma_rad, conditions, box, centre)
        for centre in (_Centre(1.0, 1.0), _Centre.within(sigma_rad))
    )


class _Centre(NamedTuple):
    """The linear object's share of the real one's gravity stiffness, γ, and of its input, c."""

    gravity: float
    push: float

    @classmethod
    def within(cls, sigma: float) -> _Centre:
        """Return the middle of what sin φ / φ and cos φ can be up to σ."""
        return cls(gravity=(1 + np.sin(sigma) / sigma) / 2, push=(1 + np.cos(sigma)) / 2)


def _peak_limit(
    beam: BeamParams,
    sigma: float,
    conditions: CertificateConditions,
    box: ParameterIntervals,
    centre: _Centre,
) -> float:
    """Return the largest bound at which the peaks of a beam of many segments stay within σ."""
    middle = linearize(beam).scaled(
        damping=float(np.mean(box.damping)), stiffness=float(np.mean(box.stiffness))
    )
    middle = replace(middle, gravity_stiffness=centre.gravity * middle.gravity_stiffness)
    if not is_hurwitz(middle.A_u):
        return 0.0
    peaks = _PeakIteration(beam, middle, conditions, box, centre)
    safe, too_much = 0.0, sigma * 10 * GRAVITY_M_S2
    for _ in range(_BISECTIONS):
        trial = (safe + too_much) / 2
        safe, too_much = (trial, too_much) if peaks.stay(trial, sigma) else (safe, trial)
    return safe


@dataclass(frozen=True)
class _Rows:
    """Gains onto (z2, ż2, z̈2, bends), bends for each pair of segments."""

    linear: LinearizedObject

    def of(self, torques: Array) -> Array:
        """Return the peak gains, (3N + N (N − 1) / 2, k), of torques on z2, columns (N, k)."""
        if not torques.any():
            return np.zeros((len(self.outputs), torques.shape[1]))
        count, A = self.linear.count, self.linear.A_u
        direct = self.linear.torque_input(torques)
        inputs = np.vstack((np.zeros_like(direct), direct))
        gains = peak_gains(A, inputs, self.outputs, samples_per_period=_COARSE)
        gains[2 * count : 3 * count] += np.abs(direct)
        return gains

    @property
    def outputs(self) -> Array:
        """C of y = (z2, ż2, z̈2, bends), (3N + N (N − 1) / 2, 2N)."""
        count = self.linear.count
        unit, (first, second) = np.eye(2 * count), np.triu_indices(count, 1)
        return np.vstack((unit, self.linear.A_u[count:], unit[first] - unit[second]))


class _PeakIteration:
    """The monotone iteration for the peaks of one box of beams."""

    def __init__(
        self,
        beam: BeamParams,
        middle: LinearizedObject,
        conditions: CertificateConditions,
        box: ParameterIntervals,
        centre: _Centre,
    ) -> None:
        self.centre = centre
        chain, nominal = HangingBeam(beam).chain, linearize(beam)
        count, rows = middle.count, _Rows(middle)
        self.moments = chain.constants.first_moments
        self.coupling = chain.constants.second_moments.copy()
        np.fill_diagonal(self.coupling, 0.0)
        self.gain = centre.push * rows.of(-nominal.m_o12[0][:, None])[:, 0]
        self.torque_gains = rows.of(np.eye(count))
        start = np.repeat(
            (conditions.initial_swing_rad, conditions.initial_swing_rate_rad_s), count
        )
        self.free = peak_free_response(middle.A_u, np.diag(start), rows.outputs)
        margins = [np.diff(interval)[0] / 2 for interval in (box.damping, box.stiffness)]
        on_rates = rows.of(margins[0] * nominal.d_o22)
        on_angles = (
            rows.of(margins[1] * nominal.k_o22)
            + rows.of(conditions.vertical_acceleration_m_s2 * nominal.vertical_stiffness)
            + rows.of(conditions.yaw_rate_rad_s**2 * nominal.centrifugal_stiffness)
        )
        self.turning = conditions.yaw_rate_rad_s**2 * np.abs(nominal.centrifugal_stiffness)
        self.loop = np.hstack((on_angles, on_rates, np.zeros_like(on_rates)))

    def stay(self, acceleration: float, sigma: float) -> bool:
        """Whether there are peaks within σ that cannot be exceeded: following(p) ≤ p."""
        peaks = np.zeros_like(self.free)
        for _ in range(_ITERATIONS):
            following = self._following(peaks, acceleration)
            if self._largest_angle(following) > sigma:
                return False
            settles = np.all(following - peaks <= _MARGIN * following)
            peaks = (1 + 2 * _MARGIN) * following if settles else following
            if settles and np.all(self._following(peaks, acceleration) <= peaks):
                return self._largest_angle(peaks) <= sigma
        return False

    def _largest_angle(self, peaks: Array) -> float:
        return float(peaks[: len(self.moments)].max())

    def _following(self, peaks: Array, acceleration: float) -> Array:
        """Return the peaks that torques of the size which ``peaks`` allow can cause."""
        torque = self._nonlinear_torque(peaks, acceleration)
        forced = self.gain * acceleration + self.torque_gains @ torque
        return self.free + forced + self.loop @ peaks[: self.loop.shape[1]]

    def _nonlinear_torque(self, peaks: Array, acceleration: float) -> Array:
        """Return R, (N,) N·m."""
        count = len(self.moments)
        angle, rate, angular_acceleration, bends = np.split(peaks, (count, 2 * count, 3 * count))
        between = np.minimum(self._bend_matrix(bends), np.pi)
        inertial = self.coupling * (1 - np.cos(between)) @ angular_acceleration
        centrifugal = self.coupling * np.sin(np.minimum(between, np.pi / 2)) @ rate**2
        gravity = GRAVITY_M_S2 * self.moments * _off_centre(angle, self.centre.gravity)
        push = np.maximum(1 - self.centre.push, self.centre.push - np.cos(angle))
        misaligned = self.moments * push * acceleration
        turned = angle - np.sin(angle) * np.maximum(np.cos(angle), 0.0)[:, None]
        turning = (self.turning * turned).sum(axis=1)
        return inertial + centrifugal + gravity + misaligned + turning

    def _bend_matrix(self, bends: Array) -> Array:
        """Return the bends between segments j and k, (N, N)."""
        matrix = np.zeros_like(self.coupling)
        matrix[np.triu_indices(len(matrix), 1)] = bends
        return matrix + matrix.T


def _off_centre(angle: Array, share: float) -> Array:
    """Return the largest |share φ − sin φ| for |φ| up to ``angle``, (N,), below π."""
    # sin φ is above the chord first, farthest where its slope is the chord's, and below it later
    steepest = np.minimum(angle, np.arccos(share))
    above = np.sin(steepest) - share * steepest
    return np.maximum(above, share * angle - np.sin(angle))
