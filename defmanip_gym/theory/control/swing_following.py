"""Swing following: the grasp goes where the object has swung to, which takes energy from it.

With x_c the object's centre of mass away from the grasp, ż_1 = κ x_c means z̈_1 = κ ẋ_c. The
forward row of m_o12 times ż2 is m_o ẋ_c: in Lemma III.1's V̇ = −ż2ᵀ d_o22 ż2 − ż2ᵀ m_o12ᵀ z̈_1
this adds −κ m_o ẋ_c²: damping from the object's shape alone, whatever its mass and damping are. The
same holds to the left, for objects that swing there.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject


class SwingFollowing:
    """Velocity and acceleration of a grasp that follows its object.

    Args:
        linear: object whose shape counts.
        rate: κ, 1/s.
    """

    def __init__(self, linear: LinearizedObject, *, rate: float) -> None:
        self.rate, self._rest = rate, linear.equilibrium
        self._levers = linear.m_o12 / linear.m_o11[0, 0]

    def motion(self, swing: Array, swing_rate: Array) -> tuple[Array, Array]:
        """Return κ x_c and κ ẋ_c, (n, 3) m/s and m/s², base frame: a rod's, else to first order.

        The vertical way, (l/2)(1 − cos φ) of a rod, is small of second order and left out.

        Args:
            swing: z2, (n, N).
            swing_rate: ż2, (n, N).
        """
        velocity, acceleration = np.zeros((2, len(swing), 3))
        away = swing - self._rest
        for axis in range(2):
            if self._levers[axis].any():
                velocity[:, axis] = self.rate * np.sin(away) @ self._levers[axis]
                acceleration[:, axis] = self.rate * (np.cos(away) * swing_rate) @ self._levers[axis]
        return velocity, acceleration
