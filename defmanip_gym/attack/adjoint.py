"""How the plant's final deformation depends on every input before it: the adjoint of a rollout."""

from __future__ import annotations

import mujoco
import numpy as np

from defmanip_gym.attack.target import YAW
from defmanip_gym.plant.rig_model import CARRIAGE_JOINTS, RigModel
from defmanip_gym.theory.dynamics.chain import Array

_CARRIAGE = len(CARRIAGE_JOINTS)
_YAW_DOF = CARRIAGE_JOINTS.index("carriage_yaw")
_PERTURBATION = 1e-6
# the effect of turning goes with the square of its rate and shows only while the object turns
_LEAST_TURNING = 0.1


class Adjoint:
    """Gradients of one coordinate at the end of a rollout.

    MuJoCo linearizes the plant along the trajectory (``mjd_transitionFD``); the costate λ of the
    object's 2N states runs back through these linearizations, λ_t = A_tᵀ λ_{t+1}, and gives
    ∂z2_k(T)/∂u_t = B_tᵀ λ_{t+1}.

    Args:
        rig: the object on its rig.
        stride: steps that share one linearization.
    """

    def __init__(self, rig: RigModel, *, stride: int = 2) -> None:
        self._rig, self._stride = rig, stride
        self._data = mujoco.MjData(rig.model)
        size = rig.model.nv
        states = np.arange(_CARRIAGE, size)
        self._states = np.concatenate((states, size + states))
        self._A = np.zeros((2 * size, 2 * size))
        self._B = np.zeros((2 * size, rig.model.nu))

    def gradient(
        self,
        inputs: Array,
        start: Array,
        *,
        coordinate: int,
        turning_rad_s: float,
    ) -> tuple[Array, Array]:
        """Return ∂z2_k/∂inputs (steps, 4) and ∂z2_k/∂start (2N,) for z2_k after the last input.

        The column of the yaw rate is the derivative by its square.

        Args:
            inputs: (steps, 4) as ``ObjectRig.play`` takes them.
            start: (z2, ż2) before the first input, (2N,).
            coordinate: k.
            turning_rad_s: the largest yaw rate, 0 if there is none.
        """
        A, B, turning = self._linearize(inputs, start, turning_rad_s)
        count = self._rig.count
        to_joints = np.kron(np.eye(2), np.linalg.inv(self._rig.read_out))
        costate = np.zeros(2 * count)
        costate[:count] = self._rig.read_out[coordinate]
        gradient = np.zeros_like(inputs)
        for index in reversed(range(len(inputs))):
            piece = index // self._stride
            gradient[index, :3] = B[piece].T @ costate
            gradient[index, YAW] = turning[piece] @ costate
            costate = A[piece].T @ costate
        return gradient, to_joints.T @ costate

    def _linearize(
        self, inputs: Array, start: Array, turning_rad_s: float
    ) -> tuple[Array, Array, Array]:
        model, data = self._rig.model, self._data
        mujoco.mj_resetData(model, data)
        to_joints, count = np.linalg.inv(self._rig.read_out), self._rig.count
        data.qpos[_CARRIAGE:] = to_joints @ start[:count]
        data.qvel[_CARRIAGE:] = to_joints @ start[count:]
        pieces = -(-len(inputs) // self._stride)
        size = 2 * count
        A, B = np.empty((pieces, size, size)), np.empty((pieces, size, 3))
        turning = np.zeros((pieces, size))
        qvel, ctrl, states = data.qvel, data.ctrl, self._states
        for index, held in enumerate(inputs):
            ctrl[:3] = held[:3]
            if index % self._stride == 0:
                piece = index // self._stride
                rate = max(held[YAW], _LEAST_TURNING * turning_rad_s)
                qvel[_YAW_DOF] = rate
                mujoco.mjd_transitionFD(
                    model, data, _PERTURBATION, False, self._A, self._B, None, None
                )
                A[piece] = self._A[np.ix_(states, states)]
                B[piece] = self._B[states, :3]
                if rate > 0:
                    turning[piece] = self._A[states, model.nv + _YAW_DOF] / (2 * rate)
            qvel[_YAW_DOF] = held[YAW]
            mujoco.mj_step(model, data)
        return A, B, turning
