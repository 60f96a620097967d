"""Lemma III.1: the energy of the object as storage function, and the structure its proof uses.

With the grasp at rest the object only loses energy, V̇ = −ż2ᵀ d_o22 ż2. With the grasp moving
(not turning) it is passive from ż1 to the force F less its weight. LaSalle then takes every motion
to an equilibrium; hanging is the only *stable* one. A beam that may turn over has others, balanced
upright, so its zero dynamics are asymptotically stable from almost everywhere, not globally.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.object_model import HangingBeam, hanging_pitch


def storage(
    model: HangingBeam, swing: Array, swing_rate: Array, grasp_velocity: Array | None = None
) -> Array:
    """Return V = ½ żᵀ M_o ż + ½ zᵀ K_o z + U of Lemma III.1, (...) J, zero hanging at rest.

    Args:
        model: the beam.
        swing: φ, (..., N) rad.
        swing_rate: φ̇, (..., N) rad/s.
        grasp_velocity: ż1, (..., 3) m/s in the base frame, which does not turn; at rest if None.
    """
    partition = model.partition(swing, swing_rate, np.zeros(np.shape(swing)[:-1]))
    kinetic = 0.5 * _form(partition.m_o22, swing_rate, swing_rate)
    if grasp_velocity is not None:
        kinetic = kinetic + _form(partition.m_o12, grasp_velocity, swing_rate)
        kinetic = kinetic + 0.5 * _form(partition.m_o11, grasp_velocity, grasp_velocity)
    elastic = 0.5 * _form(model.k_o22, swing, swing)
    raised = (model.chain.constants.first_moments * (1 - np.cos(swing))).sum(-1)
    return kinetic + elastic + GRAVITY_M_S2 * raised


def dissipation(model: HangingBeam, swing_rate: Array) -> Array:
    """Return ż2ᵀ d_o22 ż2, (...) W: what the dampers take from V."""
    return _form(model.d_o22, swing_rate, swing_rate)


def coriolis_matrix(model: HangingBeam, swing: Array, swing_rate: Array) -> Array:
    """Return C_o22 from Christoffel's symbols, (..., N, N): c_o2 = C_o22 ż2 without yaw.

    This choice makes ṁ_o22 − 2 C_o22 skew-symmetric, as the proof of Lemma III.1 needs.
    """
    coupling, alpha = model.chain.constants.second_moments, hanging_pitch(swing)
    turned = alpha[..., :, None] - alpha[..., None, :]
    return coupling * np.sin(turned) * swing_rate[..., None, :]


def _form(matrix: Array, left: Array, right: Array) -> Array:
    return np.einsum("...i,...ij,...j->...", left, matrix, right)
