"""The forces within an object from a model file, by MuJoCo's inverse dynamics on the rig."""

from __future__ import annotations

import mujoco
import numpy as np

from defmanip_gym.plant.object_copy import HELD_SITE
from defmanip_gym.plant.object_file import ObjectFile
from defmanip_gym.plant.rig_model import CARRIAGE_JOINTS
from defmanip_gym.theory.dynamics.chain import Array

CARRIAGE = len(CARRIAGE_JOINTS)
YAW = CARRIAGE_JOINTS.index("carriage_yaw")


class InternalForces:
    """Q(z2, ż2, z̈1, u2) by inverse dynamics, and its parts.

    Args:
        object_file: hangs on a carriage without inertia.
    """

    def __init__(self, object_file: ObjectFile) -> None:
        self.model = object_file.rig_model(is_heavy=False)
        self.data = mujoco.MjData(self.model)
        self.count = self.model.nv - CARRIAGE

    def __call__(
        self,
        z2: Array,
        rate: Array | None = None,
        *,
        acceleration_m_s2: Array | None = None,
        yaw_rate_rad_s: float = 0.0,
    ) -> Array:
        """Return the forces (N,) that hold z̈2 = 0."""
        data = self.data
        data.qpos[CARRIAGE:] = z2
        data.qvel[:] = 0.0
        data.qacc[:] = 0.0
        data.qvel[YAW] = yaw_rate_rad_s
        if acceleration_m_s2 is not None:
            data.qacc[:3] = acceleration_m_s2
        if rate is not None:
            data.qvel[CARRIAGE:] = rate
        mujoco.mj_inverse(self.model, data)
        return data.qfrc_inverse[CARRIAGE:].copy()

    def elastic(self, z2: Array) -> Array:
        """Return the springs' share of Q, (N,)."""
        self(z2)
        return -self.data.qfrc_spring[CARRIAGE:].copy()

    def mass_matrix(self, z2: Array) -> Array:
        """Return the mass matrix for (z̈1, u̇2, z̈2), (4 + N, 4 + N)."""
        self(z2)
        matrix = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, matrix)
        return matrix

    def potential(self, z2: Array) -> float:
        """Return U(z2) in J, of gravity, springs and tendons; its slope is Q at rest."""
        data = self.data
        data.qpos[CARRIAGE:] = z2
        mujoco.mj_fwdPosition(self.model, data)
        mujoco.mj_energyPos(self.model, data)
        return float(data.energy[0])

    def grasp_motion(self, z2: Array) -> Array:
        """Return how the grasp site moves against the carriage with z2, (3, N)."""
        self(z2)
        jacobian = np.zeros((3, self.model.nv))
        site = self.model.site(HELD_SITE).id
        mujoco.mj_jacSite(self.model, self.data, jacobian, None, site)
        return jacobian[:, CARRIAGE:]
