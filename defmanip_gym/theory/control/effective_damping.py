"""What is left of an object's damping when the force law (10) assumes another one.

Where the force loop has driven Δu_o to zero, damping D̂ assumed in place of D leaves
D_eff = D − Γ (D̂ − D) with Γ = m_o12ᵀ m̃_o11⁻¹ m_o12 m_o22⁻¹ (docs/derivations.md). For any number
of internal coordinates and any object, about its equilibrium.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, is_hurwitz

# Below this share of its mass the object shows no inertia in some direction.
_SMALLEST_INERTIA_SHARE = 1e-9
# Factors beyond this are not worth telling from "any".
_LARGEST_FACTOR = 1e6
_FACTOR_STEPS = 200
_BISECTIONS = 50


def apparent_inertia(linear: LinearizedObject) -> Array:
    """Return m̃_o11 = m_o11 − m_o12 m_o22⁻¹ m_o12ᵀ at the equilibrium, (3, 3) kg.

    Raises:
        ParameterError: it is singular, as for a point mass on a string; then Eq. (10) determines
            no acceleration and no force loop exists.
    """
    inertia = linear.m_o11 - linear.m_o12 @ linear.torque_input(linear.m_o12.T)
    smallest = float(np.linalg.eigvalsh(inertia)[0] / np.linalg.norm(linear.m_o11, 2))
    if smallest < _SMALLEST_INERTIA_SHARE:
        raise ParameterError(
            "apparent inertia",
            smallest,
            "m̃_o11 with every eigenvalue > 0",
            "Give the object's parts inertia about their joints; a point mass has none.",
        )
    return inertia


def force_tracking_gain(linear: LinearizedObject) -> Array:
    """Return Γ = m_o12ᵀ m̃_o11⁻¹ m_o12 m_o22⁻¹, (N, N); 3 for one uniform rod."""
    shown = linear.m_o12.T @ np.linalg.solve(apparent_inertia(linear), linear.m_o12)
    # shown m_o22⁻¹, both symmetric
    return np.asarray(np.linalg.solve(linear.m_o22, shown).T, dtype=np.float64)


def effective_damping(linear: LinearizedObject, assumed: Array) -> Array:
    """Return D_eff = D − Γ (D̂ − D), (N, N).

    Args:
        linear: the true object.
        assumed: D̂, the damping in the force law, (N, N).
    """
    return linear.d_o22 - force_tracking_gain(linear) @ (assumed - linear.d_o22)


def under_force_tracking(linear: LinearizedObject, assumed: Array) -> LinearizedObject:
    """Return the object as it moves where the force loop holds Δu_o at zero."""
    return replace(linear, d_o22=effective_damping(linear, assumed))


def largest_assumed_damping_factor(linear: LinearizedObject) -> float:
    """Return the largest c for which all D̂ = b D with 1 ≤ b < c leave the object stable.

    4/3 for one uniform rod, whatever its damping. Infinite where no c up to a million does harm.

    It falls with the number of segments (1.11 for two, 1.02 for five): the lighter the part at the
    grasp, the larger Γ.

    Raises:
        ParameterError: no damping to overestimate, or singular m̃_o11.
    """
    if not is_hurwitz(linear.A_u):
        raise ParameterError(
            "damping", linear.d_o22.tolist(), "damping that makes A_u Hurwitz", "Add damping."
        )

    def is_stable(factor: float) -> bool:
        return is_hurwitz(under_force_tracking(linear, factor * linear.d_o22).A_u)

    factors = 1.0 + np.geomspace(1e-4, _LARGEST_FACTOR, _FACTOR_STEPS)
    first = next((k for k, factor in enumerate(factors) if not is_stable(factor)), None)
    if first is None:
        return float("inf")
    stable, unstable = float(factors[first - 1]) if first else 1.0, float(factors[first])
    for _ in range(_BISECTIONS):
        middle = 0.5 * (stable + unstable)
        stable, unstable = (middle, unstable) if is_stable(middle) else (stable, middle)
    return stable
