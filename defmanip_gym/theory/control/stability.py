"""Stability of the closed loop: Section V, and what sampling makes of it.

In continuous time (27) with (29) is an algebraic loop; a computer closes it with one sample of
delay. ``force_loop_is_stable`` is Jury's test of that loop alone, ``SampledLoop`` the condition
that counts: the whole loop with swing, zero-order hold and velocity tracking.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.task_space import task_inertia
from defmanip_gym.theory.payload.object_model import HangingBeam


def smallest_k2(tracking_gain: float) -> float:
    """Return k2* = λ_M(P_e)² of Proposition V.1, for L = −gain · I: 1 / (4 gain²)."""
    return 1.0 / (4.0 * tracking_gain**2)


def force_loop_is_stable(gains: ForceLoopGains, period_s: float) -> bool:
    """Whether Δu[k] = −k1 Δu[k−1] − k2 T Σ Δu is stable: 0 ≤ k1 < 1, 0 < k2 < 2 (1 − k1) / T."""
    return 0 <= gains.k1 < 1 and 0 < gains.k2 < 2 * (1 - gains.k1) / period_s


@dataclass(frozen=True, kw_only=True)
class SampledLoop:
    """Linearization, along the heading and about rest at the goal, of everything in the loop.

    Attributes:
        robot: true robot; its inertia decides how far forces disturb the linearization.
        goal_pitch: (2,) rad, arm pitches at the goal.
        beam: true beam.
        linearization_beam: beam believed by the feedback linearization (28).
        force_law_damping: d̂ in the force law (10).
        gains: k1, k2 of Eq. (29).
        tracking_gain: ε of Eq. (20), 1/s.
        approach_rate: speed of the velocity field per distance near the goal, 1/s.
        period_s: control period.
        feedforward: whether u_o includes the field's change along the motion, −approach_rate · v.
    """

    robot: RobotParams
    goal_pitch: Array
    beam: BeamParams
    linearization_beam: BeamParams
    force_law_damping: float
    gains: ForceLoopGains
    tracking_gain: float
    approach_rate: float
    period_s: float
    feedforward: bool = False

    def spectral_radius(self) -> float:
        """Return the largest |eigenvalue| over one sample; the loop is stable below 1."""
        return float(np.abs(np.linalg.eigvals(self.transition_matrix())).max())

    def transition_matrix(self) -> Array:
        """Return the map of (p, v, φ, φ̇, held input, previous u_o, ∫Δu_o) over one sample."""
        count = self.beam.segment_count
        size = 2 + 2 * count
        rest = np.zeros(count)
        model = HangingBeam(self.beam)
        partition = model.partition(rest, rest, np.zeros(()))
        gravity = GRAVITY_M_S2 * np.diag(model.chain.constants.first_moments)
        stiffness, damping = model.k_o22 + gravity, model.d_o22
        coupling = partition.m_o12[0]
        feedthrough = np.linalg.solve(partition.m_o22, coupling)  # m_o22⁻¹ m_o12ᵀ, forward
        apparent = model.apparent_inertia(partition)
        compliance = np.linalg.inv(task_inertia(self.robot, self.goal_pitch) + apparent)[0, 0]
        believed = HangingBeam(self.linearization_beam).d_o22
        assumed = HangingBeam(self.beam, damping=self.force_law_damping).d_o22

        # grasp acceleration = held input + compliance · (what the beam's state does to the grasp)
        reaction = compliance * np.concatenate((feedthrough @ stiffness, feedthrough @ damping))
        A = np.zeros((size, size))
        A[0, 1] = 1.0
        A[1, 2:] = reaction
        A[2 : 2 + count, 2 + count :] = np.eye(count)
        A[2 + count :, 2:] = -np.linalg.solve(
            partition.m_o22, np.hstack((stiffness, damping))
        ) - np.outer(feedthrough, reaction)
        B = np.concatenate(([0.0, 1.0], rest, -feedthrough))
        hold = expm(np.block([[A, B[:, None]], [np.zeros((1, size + 1))]]) * self.period_s)
        advance, forced = hold[:size, :size], hold[:size, size]

        # the feedback linearization looks half a period ahead (envs/engine.py)
        half = 0.5 * self.period_s
        compensation = compliance * np.concatenate(
            (feedthrough @ stiffness, feedthrough @ (believed + half * stiffness))
        )
        misjudged = feedthrough @ (damping - assumed) / apparent[0, 0]

        def one_sample(state: Array) -> Array:
            x, held, u_o_before, integral = state[:size], state[-3], state[-2], state[-1]
            measured = held + reaction @ x[2:] - misjudged @ x[2 + count :]
            error = measured - u_o_before
            integral = integral + self.period_s * error
            u_o = -self.tracking_gain * (x[1] + self.approach_rate * x[0])
            if self.feedforward:
                u_o = u_o - self.approach_rate * x[1]
            held = u_o - self.gains.k1 * error - self.gains.k2 * integral - compensation @ x[2:]
            return np.concatenate((advance @ x + forced * held, (held, u_o, integral)))

        return np.stack([one_sample(unit) for unit in np.eye(size + 3)], axis=1)
