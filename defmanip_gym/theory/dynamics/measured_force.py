"""Joint-space control that knows no object: Eqs. (2), (3) with the grasp force as it is measured.

T_r = M_r v̇_des + C_r + J_Aᵀ F gives 𝒯 = 𝓜 w + 𝓒 + F by Eq. (4). With F as last read the grasp gets
(𝓜 + m̃_o11) ẍ_a = 𝓜 w + m̃_o11 ẍ_a[k−1]: the payload's apparent inertia is a lag of one sample,
stable for any object (docs/derivations.md). Torques that the grasp passes on are not measured.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.params import RobotParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import (
    ArmLengths,
    reach_and_height,
    reach_and_height_slopes,
)


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
    ) -> Array:
        """Return T_r = (f_b, α_b, τ1, τ2), shape (n, 4) in N and N·m.

        Args:
            w: task-space acceleration, (n, 3) m/s², base frame.
            joints: q_a, (n, 2) rad.
            joint_rates: q̇_a, (n, 2) rad/s.
            base_velocity: (u1, u2), (n, 2) m/s, rad/s.
            grasp_force_b: F, the force on the object as read, (n, 3) N.
        """
        nothing = np.empty((len(w), 0))
        forces = self._alone.generalized_forces(
            w, joints, joint_rates, base_velocity, nothing, nothing
        )
        pitch = np.cumsum(joints, axis=1)
        force_b = np.ascontiguousarray(grasp_force_b, dtype=np.float64)
        _add_grasp_forces(self._alone.model.arm, pitch, force_b, forces)
        return forces


@compilable
def add_grasp_force_at(
    arm: ArmLengths, upper: float, fore: float, force_b: Array, forces: Array, i: int
) -> None:
    """Add J_Aᵀ F of Eq. (2) for one state to row i of ``forces``, (n, 4) N and N·m.

    Args:
        arm: lengths as believed.
        upper: α1, rad.
        fore: α2, rad.
        force_b: F, (n, 3) N, of which row i counts.
        forces: T_r without an object, to which it is added.
        i: the row.
    """
    forward, left, up = force_b[i, 0], force_b[i, 1], force_b[i, 2]
    reach, _ = reach_and_height(arm, upper, fore)
    rho_1, rho_2, z_1, z_2 = reach_and_height_slopes(arm, upper, fore)
    elbow = rho_2 * forward + z_2 * up
    forces[i, 0] += forward
    forces[i, 1] += reach * left
    # q1 turns both links
    forces[i, 2] += rho_1 * forward + z_1 * up + elbow
    forces[i, 3] += elbow


@compiled
def _add_grasp_forces(arm: ArmLengths, pitch: Array, force_b: Array, forces: Array) -> None:
    for i in range(len(forces)):
        add_grasp_force_at(arm, pitch[i, 0], pitch[i, 1], force_b, forces, i)
