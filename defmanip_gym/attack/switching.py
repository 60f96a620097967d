"""Open-loop and feedback inputs that are optimal, or nearly, for the linear object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, expm

from defmanip_gym.attack.target import UP, YAW
from defmanip_gym.plant.object_rig import Command
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject


def worst_switching(
    linear: LinearizedObject, *, coordinate: int, steps: int, timestep_s: float, stretch: float = 1
) -> tuple[Array, Array]:
    """Return the input that drives one coordinate of the linear object farthest at its end.

    That is a_j(t) = sign(c_k e^{A (T − t)} b_j) for the three accelerations; it leaves turning out.

    Args:
        linear: the linear object.
        coordinate: k.
        steps: length of the sequence.
        timestep_s: how long each input holds.
        stretch: factor on time; nonlinear objects swing more slowly the farther they swing.

    Returns:
        inputs (steps, 4) in shares of their limits, and the start (2N,) in shares of its limits.
    """
    transition = expm(linear.A_u * (timestep_s / stretch)).T
    costate = np.eye(2 * linear.count)[coordinate]
    horizontal = linear.B_u[:, 6:]
    shares = np.zeros((steps, 4))
    for index in reversed(range(steps)):
        shares[index, :UP] = np.sign(costate @ horizontal)[:UP]
        costate = transition @ costate
    return shares, np.sign(costate)


@dataclass(frozen=True, kw_only=True)
class FeedbackLaw:
    """Push each input outward along s = p ż2 + q (z2 − z2*), as hard as its limit allows.

    For one hinge and s = φ̇ this is the worst input there is: a = −ā sign(φ̇) and the same for
    lifting and turning. Rows of ``p`` and ``q`` belong to simulations.
    """

    linear: LinearizedObject
    p: Array
    q: Array

    def command(self, limits: Array) -> Command:
        """Return the command for limits of the inputs, (n, 4)."""
        linear, p, q = self.linear, self.p, self.q
        along = p @ linear.torque_input(-linear.m_o12.T)
        lifting = p @ linear.torque_input(-linear.vertical_stiffness)
        turning = p @ linear.torque_input(linear.centrifugal_stiffness)
        has_up, has_yaw = limits[:, UP].any(), limits[:, YAW].any()

        def command(_: float, z2: Array, z2_rate: Array) -> Array:
            offset = z2 - linear.equilibrium
            outward = (p * z2_rate + q * offset).sum(axis=1)
            # at rest every direction is as good as another
            outward = np.where(outward == 0.0, 1.0, outward)
            inputs = np.zeros((len(outward), 4))
            inputs[:, :3] = np.sign(along * outward[:, None])
            if has_up:
                push = (lifting * offset).sum(axis=1) + along[:, UP]
                inputs[:, UP] = np.sign(push * outward)
            if has_yaw:
                inputs[:, YAW] = (turning * offset).sum(axis=1) * outward > 0
            return inputs * limits

        return command

    def repeated(self, index: int, count: int) -> FeedbackLaw:
        """Return one of the laws for ``count`` simulations."""
        return FeedbackLaw(
            linear=self.linear,
            p=np.tile(self.p[index], (count, 1)),
            q=np.tile(self.q[index], (count, 1)),
        )


def modal_laws(linear: LinearizedObject, *, count: int) -> FeedbackLaw:
    """Return laws that pump one undamped mode each, slow ones first, with three phases each."""
    stiffness = linear.k_o22 + linear.gravity_stiffness
    squares, modes = eigh((stiffness + stiffness.T) / 2, linear.m_o22)
    frequencies = np.sqrt(np.maximum(squares, 0.0))
    laws = [
        (weights, phase * frequency * weights)
        for frequency, weights in zip(frequencies, modes.T @ linear.m_o22, strict=True)
        for phase in ((0.0, 0.3, -0.3) if linear.count > 1 else (0.0,))
    ][:count]
    chosen = [laws[index % len(laws)] for index in range(count)]
    return FeedbackLaw(
        linear=linear, p=np.array([p for p, _ in chosen]), q=np.array([q for _, q in chosen])
    )
