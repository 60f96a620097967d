"""Redundancy resolution of Section IV.B: who realizes which part of the task acceleration.

The base spans the horizontal plane (range of J_Ab, the paper's S_b) and the arm its complement,
the vertical (S_a). A two-joint arm then has one self-motion left, the reach ρ; the paper's
−k3(q̇ + k ∇φ) term drives it to the reach of the goal, with the potential ½(ρ − ρ*)². The base
makes up for the arm's horizontal motion, so the grasp acceleration is exactly w.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from defmanip_gym.compiled import Numbers, compilable
from defmanip_gym.params import RobotParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import (
    ArmKinematics,
    ArmLengths,
    components,
    reach_and_height,
    reach_and_height_bias,
    reach_and_height_slopes,
)
from defmanip_gym.validation import require_positive


def task_planes(base_jacobian: Array) -> tuple[Array, Array]:
    """Return the projections S_b, S_a of Section IV.B, (..., 3, 3) each.

    The print takes range and kernel of J_Abᵀ and J_Ab, which lie in the space of (u1, u2), where
    S_b w has no meaning. In the task space S_b projects on range(J_Ab), what the base can do, and
    S_a on its complement, what only the arm can do.

    Args:
        base_jacobian: J_Ab, the first two columns of J_A, (..., 3, 2).
    """
    S_b = base_jacobian @ np.linalg.pinv(base_jacobian)
    return S_b, np.eye(base_jacobian.shape[-2]) - S_b


class ReachRule(NamedTuple):
    """The self-motion: ρ̈ = −k3 (ρ̇ + k (ρ − ρ*))."""

    goal_reach_m: float
    k: float
    k3: float


@compilable
def shared_acceleration(
    arm: ArmLengths,
    rule: ReachRule,
    w_forward: Numbers,
    w_left: Numbers,
    w_up: Numbers,
    upper: Numbers,
    fore: Numbers,
    upper_rate: Numbers,
    fore_rate: Numbers,
    u1: Numbers,
    u2: Numbers,
) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return u̇1, u̇2, α̈1, α̈2, (...) each; see ``RedundancyResolution.accelerations``."""
    reach, _ = reach_and_height(arm, upper, fore)
    rho_1, rho_2, z_1, z_2 = reach_and_height_slopes(arm, upper, fore)
    reach_rate = rho_1 * upper_rate + rho_2 * fore_rate
    reach_acceleration = -rule.k3 * (reach_rate + rule.k * (reach - rule.goal_reach_m))
    reach_bias, height_bias = reach_and_height_bias(arm, upper, fore, upper_rate, fore_rate)
    # the arm realizes ρ̈ and w_z, the base the rest of w
    along, up = reach_acceleration - reach_bias, w_up - height_bias
    determinant = rho_1 * z_2 - rho_2 * z_1
    return (
        w_forward - reach_acceleration + reach * u2**2,
        (w_left - 2 * reach_rate * u2 - u1 * u2) / reach,
        (z_2 * along - rho_2 * up) / determinant,
        (rho_1 * up - z_1 * along) / determinant,
    )


class RedundancyResolution:
    """Turns a task-space acceleration into accelerations of base and arm.

    Args:
        robot: arm geometry.
        goal_reach_m: ρ*, the reach to settle at.
        k: rate at which the reach approaches ρ*, 1/s.
        k3: gain on its velocity error, 1/s.
    """

    def __init__(
        self, robot: RobotParams, *, goal_reach_m: float, k: float = 0.5, k3: float = 2.0
    ) -> None:
        self.rule = ReachRule(
            require_positive("goal_reach_m", goal_reach_m, "m"),
            require_positive("k", k, "1/s"),
            require_positive("k3", k3, "1/s"),
        )
        self.kinematics = ArmKinematics(robot)

    def accelerations(
        self, w: Array, pitch: Array, pitch_rate: Array, base_velocity: Array
    ) -> Array:
        """Return (u̇1, u̇2, α̈1, α̈2), shape (..., 4), that give the grasp the acceleration w.

        Args:
            w: (..., 3) m/s², base frame.
            pitch: α of the arm, (..., 2) rad, away from a straight or folded elbow.
            pitch_rate: α̇, (..., 2) rad/s.
            base_velocity: (u1, u2), (..., 2).
        """
        return np.stack(
            shared_acceleration(
                self.kinematics.lengths,
                self.rule,
                *components(w),
                *components(pitch),
                *components(pitch_rate),
                *components(base_velocity),
            ),
            axis=-1,
        )
