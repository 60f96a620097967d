"""Stability of tracking with a disturbance observer over either inner loop, sample by sample.

About rest at the goal in all three axes of the base frame. With b(z2) what the object's springs,
dampers and weight do to the grasp, (𝓜 + m̃_o11) ẍ_a + b = 𝒯 − 𝓒 for the true object, and

    inner loop "model", Eq. (28):     𝒯 − 𝓒 = (𝓜 + m̃̂_o11) w + b̂ half a period ahead
    inner loop "measured_force":      𝒯 − 𝓒 = 𝓜 w + F[k] + m̂ (w − ẍ_a[k−1]),
                                      F[k] = m̃_o11 ẍ_a[k−] + b[k]

so that the measured force closes a loop of its own with the poles of (𝓜 + m̃_o11)⁻¹ (m̃_o11 − m̂), all
of them 0 for a uniform rod (docs/derivations.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_lyapunov

from defmanip_gym.params import RobotParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.measured_force import ROD_SHARE
from defmanip_gym.theory.dynamics.task_space import task_inertia
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject

_AXES = 3


@dataclass(frozen=True, kw_only=True)
class HangingObject:
    """An object about rest: b(z2) = −m_o12 m_o22⁻¹ (K φ + D φ̇) and how it follows the grasp.

    Attributes:
        coupling: m_o12, (3, N) kg·m.
        apparent: m̃_o11, (3, 3) kg.
        follows: m_o22⁻¹ m_o12ᵀ, (N, 3) 1/m.
        stiffness: K with gravity's, (N, N) N·m/rad.
        damping: D, (N, N) N·m·s/rad.
        inertia: m_o22, (N, N) kg·m².
        levers: x_c per φ, (3, N) m.
    """

    coupling: Array
    apparent: Array
    follows: Array
    stiffness: Array
    damping: Array
    inertia: Array
    levers: Array

    @classmethod
    def of(cls, linear: LinearizedObject) -> HangingObject:
        """Return that of an object."""
        follows = np.asarray(np.linalg.solve(linear.m_o22, linear.m_o12.T), np.float64)
        return cls(
            coupling=linear.m_o12,
            apparent=linear.m_o11 - linear.m_o12 @ follows,
            follows=follows,
            stiffness=linear.k_o22 + linear.gravity_stiffness,
            damping=linear.d_o22,
            inertia=linear.m_o22,
            levers=linear.m_o12 / linear.m_o11[0, 0],
        )

    def force(self, ahead_s: float = 0.0) -> Array:
        """Return b as a (3, 2N) matrix on (φ, φ̇), φ taken ``ahead_s`` later."""
        damping = self.damping + ahead_s * self.stiffness
        return -self.follows.T @ np.hstack((self.stiffness, damping))


@dataclass(frozen=True, kw_only=True)
class ObservedLoop:
    """Linearization about rest at the goal of inner loop, tracking (20) and observer.

    Attributes:
        robot: true robot.
        goal_pitch: (2,) rad, arm pitches at the goal.
        carried: true object.
        believed: by the inner loop (28); None for the one that measures the force.
        tracking_gain: ε of Eq. (20), 1/s.
        approach_rate: speed of the velocity field per distance near the goal, 1/s.
        observer_gain: L, 1/s.
        following_rate: κ of swing following, 1/s.
        period_s: control period T.
        delay_periods: control periods until w takes effect.
        felt_inertia_kg: diagonal of m̂, a uniform rod's by default.
    """

    robot: RobotParams
    goal_pitch: Array
    carried: LinearizedObject
    believed: LinearizedObject | None
    tracking_gain: float
    approach_rate: float
    observer_gain: float
    following_rate: float
    period_s: float
    delay_periods: int = 0
    felt_inertia_kg: tuple[float, float, float] | None = None

    def spectral_radius(self) -> float:
        """Return the largest |eigenvalue| over one sample; the loop is stable below 1."""
        return float(np.abs(np.linalg.eigvals(self.transition_matrix())).max())

    def velocity_deviation(self, force_noise_n: float) -> Array:
        """Return the standard deviation of the grasp's velocity, (3,) m/s, from a noisy force.

        Args:
            force_noise_n: standard deviation of each reading and axis, independent; it enters
                where F does, so only in the loop that measures it.
        """
        advance, noise = self._maps()
        spread = solve_discrete_lyapunov(advance, force_noise_n**2 * noise @ noise.T)
        deviation: Array = np.sqrt(np.diag(spread)[_AXES : 2 * _AXES])
        return deviation

    def transition_matrix(self) -> Array:
        """Return the map over a sample of (p, v, φ, φ̇, F, d, v_last, w under way); w_last leads."""
        return self._maps()[0]

    def _maps(self) -> tuple[Array, Array]:
        """Return what the state and what the force sensor's noise become over a sample."""
        true, half = HangingObject.of(self.carried), 0.5 * self.period_s
        count = self.carried.count
        size = 2 * _AXES + 2 * count
        M = task_inertia(self.robot, self.goal_pitch)
        compliance = np.linalg.inv(M + true.apparent)
        advance, forced = _held(true, -compliance @ true.force(), self.period_s)
        if self.believed is None:
            own = self.carried.m_o11[0, 0] * np.array((ROD_SHARE, 1.0, 1.0))
            weighed = np.diag(own if self.felt_inertia_kg is None else self.felt_inertia_kg)
            feeds, shown, seen = M + weighed, np.zeros((_AXES, 2 * count)), np.eye(_AXES)
        else:
            believed = HangingObject.of(self.believed)
            feeds, shown = M + believed.apparent, believed.force(half)
            seen = weighed = np.zeros((_AXES, _AXES))
        step = self.period_s * self.observer_gain
        under_way = max(1, self.delay_periods)

        def one_sample(state: Array) -> Array:
            x, (F, d, v_last, *queue) = state[:size], state[size:].reshape(-1, _AXES)
            p, v, swing = x[:_AXES], x[_AXES : 2 * _AXES], x[2 * _AXES :]
            gained = (v - v_last) / self.period_s
            d = d + step * (gained - queue[-1] - d)
            following = self.following_rate * true.levers
            desired = following @ swing[:count] - self.approach_rate * p
            desired_rate = following @ swing[count:] - self.approach_rate * v
            u_o = desired_rate - self.tracking_gain * (v - desired)
            queue = [*queue[-under_way:], u_o - d]
            acting = queue[-1 - self.delay_periods]
            held = compliance @ (feeds @ acting + shown @ swing + seen @ F - weighed @ gained)
            after = advance @ x + forced @ held
            swing = after[2 * _AXES :]
            acceleration = held - compliance @ true.force() @ swing
            F = true.apparent @ acceleration + true.force() @ swing
            return np.concatenate((after, F, d, v, *queue[-under_way:]))

        width = size + _AXES * (3 + under_way)
        matrix = np.stack([one_sample(unit) for unit in np.eye(width)], axis=1)
        return matrix, matrix[:, size : size + _AXES]


def _held(true: HangingObject, reaction: Array, period_s: float) -> tuple[Array, Array]:
    """Return what a period makes of (p, v, φ, φ̇) and of a held acceleration, (3,) m/s²."""
    count = len(true.inertia)
    size = 2 * _AXES + 2 * count
    A = np.zeros((size, size))
    A[:_AXES, _AXES : 2 * _AXES] = np.eye(_AXES)
    A[_AXES : 2 * _AXES, 2 * _AXES :] = reaction
    A[2 * _AXES : -count, -count:] = np.eye(count)
    own = np.linalg.solve(true.inertia, np.hstack((true.stiffness, true.damping)))
    A[-count:, 2 * _AXES :] = -own - true.follows @ reaction
    B = np.vstack((np.zeros((_AXES, 3)), np.eye(3), np.zeros((count, 3)), -true.follows))
    hold = expm(np.block([[A, B], [np.zeros((3, size + 3))]]) * period_s)
    return hold[:size, :size], hold[:size, size:]
