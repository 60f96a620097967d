"""Joint-space control that knows no object: Eqs. (2), (3) with the grasp force as it is measured.

    T_r = M_r v̇_des + C_r + J_Aᵀ (F + m̂ (w − ẍ_a))

By Eq. (4) that is 𝒯 = 𝓜 w + 𝓒 + F + m̂ (w − ẍ_a), with F as last read and ẍ_a what the grasp had
when it was read. The first three terms are Eq. (3) solved for 𝒯; alone they give (𝓜 + m̃_o11) ẍ_a =
𝓜 w + m̃_o11 ẍ_a[k−1]: what the object weighs is known, but its inertia is felt one sample late. The
last term makes up for that with the mass as it was weighed at rest, m̂ = m (I − ¾ d dᵀ) as of a
uniform rod swung out to d: then ẍ_a − w = (𝓜 + m̃_o11)⁻¹ (m̃_o11 − m̂)(ẍ_a[k−1] − w), which is 0 for
rods and dies out for every object with m̂ < 𝓜 + 2 m̃_o11 (docs/derivations.md). Torques that the
grasp passes on are not measured.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from defmanip_gym.compiled import Numbers, compilable, compiled
from defmanip_gym.params import GRAVITY_M_S2, RobotParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import (
    ArmLengths,
    reach_and_height,
    reach_and_height_slopes,
)

# of a uniform rod's mass along the way that it swings: 1 − m_o12 m_o22⁻¹ m_o12ᵀ / m_o
ROD_SHARE = 0.25


@compilable
def weighed_mass(forward_n: Numbers, up_n: Numbers, swing: Numbers) -> Numbers:
    """Return m, (...) kg, from the force on an object at rest that hangs at φ, (...).

    A rod lets its grasp feel F·e = m g cos φ along itself, e = (−sin φ, cos φ), however it turns.
    """
    return (up_n - forward_n * np.tan(swing)) / GRAVITY_M_S2


class MeasuredForceLinearization:
    """Computed generalized forces T_r for a task-space acceleration and a measured grasp force.

    Args:
        robot: nominal robot.
        resolution: how base and arm share the task.
    """

    def __init__(self, robot: RobotParams, resolution: RedundancyResolution) -> None:
        self._alone = FeedbackLinearization(robot, None, resolution)

    def generalized_forces(
        self,
        w: Array,
        joints: Array,
        joint_rates: Array,
        base_velocity: Array,
        grasp_force_b: Array,
        acceleration_b: Array,
        mass_kg: Array,
        swing: Array,
    ) -> Array:
        """Return T_r = (f_b, α_b, τ1, τ2), shape (n, 4) in N and N·m.

        Args:
            w: task-space acceleration, (n, 3) m/s², base frame.
            joints: q_a, (n, 2) rad.
            joint_rates: q̇_a, (n, 2) rad/s.
            base_velocity: (u1, u2), (n, 2) m/s, rad/s.
            grasp_force_b: F, the force on the object as read, (n, 3) N.
            acceleration_b: ẍ_a of the grasp when F was read, (n, 3) m/s².
            mass_kg: m of the object as weighed, (n,).
            swing: φ of the object at the grasp, (n,) rad.
        """
        nothing = np.empty((len(w), 0))
        forces = self._alone.generalized_forces(
            w, joints, joint_rates, base_velocity, nothing, nothing
        )
        _add_grasp_forces(
            self._alone.model.arm,
            np.ascontiguousarray(w),
            np.ascontiguousarray(joints),
            np.ascontiguousarray(grasp_force_b),
            np.ascontiguousarray(acceleration_b),
            np.ascontiguousarray(mass_kg),
            np.ascontiguousarray(swing),
            forces,
        )
        return forces


@compilable
def add_grasp_force_at(
    arm: ArmLengths,
    w_forward: float,
    w_left: float,
    w_up: float,
    upper: float,
    fore: float,
    swing: float,
    force_b: Array,
    acceleration_b: Array,
    mass_kg: Array,
    forces: Array,
    i: int,
) -> None:
    """Add J_Aᵀ (F + m̂ (w − ẍ_a)) for one state to row i of ``forces``, (n, 4) N and N·m.

    Args:
        arm: lengths as believed.
        w_forward: task-space acceleration, m/s², base frame.
        w_left: to the left.
        w_up: and upwards.
        upper: α1, rad.
        fore: α2, rad.
        swing: φ of the object at the grasp, rad.
        force_b: F, (n, 3) N, of which row i counts, as below.
        acceleration_b: ẍ_a when F was read, (n, 3) m/s².
        mass_kg: m of the object as weighed, (n,).
        forces: T_r without an object, to which it is added.
        i: the row.
    """
    mass = mass_kg[i]
    c, s = cos(swing), sin(swing)
    ahead, above = w_forward - acceleration_b[i, 0], w_up - acceleration_b[i, 2]
    along = (1.0 - ROD_SHARE) * (c * ahead + s * above)
    forward = force_b[i, 0] + mass * (ahead - c * along)
    left = force_b[i, 1] + mass * (w_left - acceleration_b[i, 1])
    up = force_b[i, 2] + mass * (above - s * along)
    add_force_at(arm, forward, left, up, upper, fore, forces, i)


@compilable
def add_force_at(
    arm: ArmLengths,
    forward: float,
    left: float,
    up: float,
    upper: float,
    fore: float,
    forces: Array,
    i: int,
) -> None:
    """Add J_Aᵀ times a force at the grasp, base frame, to row i of ``forces``, (n, 4)."""
    reach, _ = reach_and_height(arm, upper, fore)
    rho_1, rho_2, z_1, z_2 = reach_and_height_slopes(arm, upper, fore)
    elbow = rho_2 * forward + z_2 * up
    forces[i, 0] += forward
    forces[i, 1] += reach * left
    # q1 turns both links
    forces[i, 2] += rho_1 * forward + z_1 * up + elbow
    forces[i, 3] += elbow


@compiled
def _add_grasp_forces(
    arm: ArmLengths,
    w: Array,
    joints: Array,
    force_b: Array,
    acceleration_b: Array,
    mass_kg: Array,
    swing: Array,
    forces: Array,
) -> None:
    for i in range(len(forces)):
        upper = joints[i, 0]
        add_grasp_force_at(
            arm,
            w[i, 0],
            w[i, 1],
            w[i, 2],
            upper,
            upper + joints[i, 1],
            swing[i],
            force_b,
            acceleration_b,
            mass_kg,
            forces,
            i,
        )
