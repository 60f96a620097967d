"""Swing following: the grasp goes where the object has swung to, which takes energy from it.

With x_c the object's centre of mass forward of the grasp, ż_1 = κ x_c means z̈_1 = κ ẋ_c. The
forward row of m_o12 times ż2 is m_o ẋ_c: in Lemma III.1's V̇ = −ż2ᵀ d_o22 ż2 − ż2ᵀ m_o12ᵀ z̈_1
this adds −κ m_o ẋ_c²: damping from the object's shape alone, whatever its mass and damping are.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.dynamics.chain import Array, YawingChain, beam_links


class SwingFollowing:
    """Velocity and acceleration of a grasp that follows its object.

    Args:
        beam: whose shape counts.
        rate: κ, 1/s.
    """

    def __init__(self, beam: BeamParams, *, rate: float) -> None:
        constants = YawingChain(beam_links(beam)).constants
        self.rate = rate
        self._levers_m = constants.first_moments / constants.total_mass

    def motion(self, swing: Array, swing_rate: Array) -> tuple[Array, Array]:
        """Return κ x_c and κ ẋ_c, (n, 3) m/s and m/s², base frame; forward only.

        The vertical way, (l/2)(1 − cos φ) of a rod, is small of second order and left out.

        Args:
            swing: φ, (n, N) rad.
            swing_rate: φ̇, (n, N) rad/s.
        """
        velocity, acceleration = np.zeros((2, len(swing), 3))
        velocity[:, 0] = self.rate * np.sin(swing) @ self._levers_m
        acceleration[:, 0] = self.rate * (np.cos(swing) * swing_rate) @ self._levers_m
        return velocity, acceleration
