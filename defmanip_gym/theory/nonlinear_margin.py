"""How much of a bound is proven for the nonlinear beam, not just for its linearization.

One hinge: exactly, in the phase plane. More segments: the nonlinear terms of Eq. (6b) enter the
linear object as torques whose size is bounded by the peaks of |z2|, |ż2| and |z̈2| so far,

    R = H (1 − cos δ) |z̈2| + H |sin δ| ż2² + g S (|φ| − sin|φ|) + S (1 − cos φ) ā
        + u2² |Γ_ω| (|φ_k| − sin|φ_k| cos φ_j),

δ_jk = |φ_j| + |φ_k|, H the inertial coupling and S the first moments. Peaks that satisfy
p = β + g ā + Θ p + T R(p) cannot be exceeded (docs/derivations.md, section 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.chain import Array
from defmanip_gym.theory.conditions import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.impulse_response import peak_free_response, peak_gains
from defmanip_gym.theory.object_model import HangingBeam
from defmanip_gym.theory.phase_plane import one_hinge_limit
from defmanip_gym.theory.zero_dynamics import LinearizedObject, is_hurwitz, linearize

_BISECTIONS = 25
_ITERATIONS = 300
_MARGIN = 1e-4


def nonlinear_limit_in_box(
    beam: BeamParams,
    sigma_rad: float,
    conditions: CertificateConditions,
    box: ParameterIntervals,
) -> float:
    """Return an acceleration bound (m/s²) proven for the nonlinear beam; 0 if none was found."""
    if beam.segment_count == 1:
        return one_hinge_limit(beam, sigma_rad, conditions, box)
    middle = linearize(beam).scaled(
        damping=float(np.mean(box.damping)), stiffness=float(np.mean(box.stiffness))
    )
    if not is_hurwitz(middle.A_u):
        return 0.0
    peaks = _PeakIteration(beam, middle, conditions, box)
    safe, too_much = 0.0, sigma_rad * 10 * GRAVITY_M_S2
    for _ in range(_BISECTIONS):
        trial = (safe + too_much) / 2
        safe, too_much = (trial, too_much) if peaks.stay(trial, sigma_rad) else (safe, trial)
    return safe


@dataclass(frozen=True)
class _Rows:
    """Gains onto (z2, ż2, z̈2)."""

    linear: LinearizedObject

    def of(self, torques: Array) -> Array:
        """Return the peak gains, (3N, k), of torques on z2 given by columns (N, k)."""
        count, A = self.linear.count, self.linear.A_u
        direct = self.linear.torque_input(torques)
        inputs = np.vstack((np.zeros_like(direct), direct))
        gains = peak_gains(A, inputs, self.outputs)
        gains[2 * count :] += np.abs(direct)
        return gains

    @property
    def outputs(self) -> Array:
        """C of y = (z2, ż2, z̈2), (3N, 2N)."""
        return np.vstack((np.eye(2 * self.linear.count), self.linear.A_u[self.linear.count :]))


class _PeakIteration:
    """The monotone iteration for the peaks of one box of beams."""

    def __init__(
        self,
        beam: BeamParams,
        middle: LinearizedObject,
        conditions: CertificateConditions,
        box: ParameterIntervals,
    ) -> None:
        chain, nominal = HangingBeam(beam).chain, linearize(beam)
        count, rows = middle.count, _Rows(middle)
        self.moments = chain.constants.first_moments
        self.coupling = chain.constants.second_moments.copy()
        np.fill_diagonal(self.coupling, 0.0)
        self.gain = rows.of(-nominal.m_o12[0][:, None])[:, 0]
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
        peaks = np.zeros(3 * len(self.moments))
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
        """Return the peaks that torques of the size which ``peaks`` allow can cause, (3N,)."""
        torque = self._nonlinear_torque(peaks, acceleration)
        forced = self.gain * acceleration + self.torque_gains @ torque
        return self.free + forced + self.loop @ peaks

    def _nonlinear_torque(self, peaks: Array, acceleration: float) -> Array:
        """Return R, (N,) N·m."""
        angle, rate, angular_acceleration = np.split(peaks, 3)
        between = np.minimum(angle[:, None] + angle, np.pi)
        inertial = self.coupling * (1 - np.cos(between)) @ angular_acceleration
        centrifugal = self.coupling * np.sin(np.minimum(between, np.pi / 2)) @ rate**2
        softening = GRAVITY_M_S2 * self.moments * (angle - np.sin(angle))
        misaligned = self.moments * (1 - np.cos(angle)) * acceleration
        turned = angle - np.sin(angle) * np.maximum(np.cos(angle), 0.0)[:, None]
        turning = (self.turning * turned).sum(axis=1)
        return inertial + centrifugal + softening + misaligned + turning
