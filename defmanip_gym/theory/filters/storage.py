"""Lemma III.1's storage V as a barrier: its lowest pass out of σ, and one period of it ahead.

V = ½ ż2ᵀ m_o22 ż2 + U never rises while the grasp does not accelerate, damped or not. What turning
does is put in as if it were stored: B = V + ½ u2² (I_σ − I_z(z2)), with I_z the object's inertia
about the vertical through the grasp and I_σ its largest within σ. Then

    Ḃ = −ż2ᵀ d_o22 ż2 − s_f a_f − s_u a_u + u2 u̇2 (I_σ − I_z),   B ≥ V,

with s = m_o12ᵀ ż2 forward and upward, so that B does not rise either while |u2| does not.
Derivation: docs/derivations.md, section 18.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from defmanip_gym.compiled import compilable
from defmanip_gym.errors import CertificateError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.dynamics.chain import Array, solve_positive_definite
from defmanip_gym.theory.payload.object_model import HangingBeam


class StorageModel(NamedTuple):
    """What V and B of C beams with N segments depend on (compiled code takes named tuples).

    Attributes:
        moments: p, (C, N) kg·m.
        coupling: W, (C, N, N) kg·m².
        inertia: own inertia of the segments, (C, N) kg·m².
        spin: the same less that about their axis, (C, N) kg·m².
        stiffness: k_o22, (C, N, N) N·m/rad.
        damping: d_o22, (C, N, N) N·m·s/rad; none unless asked for: V counts on none.
        yaw_inertia: I_σ − I_z(0), (C,) kg·m².
        mass: (C,) kg.
        passes: V_σ, (C,) J.
    """

    moments: Array
    coupling: Array
    inertia: Array
    spin: Array
    stiffness: Array
    damping: Array
    yaw_inertia: Array
    mass: Array
    passes: Array

    @classmethod
    def of(
        cls, beams: tuple[BeamParams, ...], sigma_rad: float, *, damped: bool = False
    ) -> StorageModel:
        """Return the model of beams with equally many segments, with their damping or without."""
        models = [HangingBeam(beam) for beam in beams]
        chains = [model.chain.constants for model in models]
        spins = [chain.transverse - chain.axial for chain in chains]
        return cls(
            moments=np.array([chain.first_moments for chain in chains]),
            coupling=np.array([chain.second_moments for chain in chains]),
            inertia=np.array([chain.transverse for chain in chains]),
            spin=np.array(spins),
            stiffness=np.array([model.k_o22 for model in models]),
            damping=float(damped) * np.array([model.d_o22 for model in models]),
            yaw_inertia=np.array(
                [
                    sin(sigma_rad) ** 2 * (chain.second_moments.sum() + spin.sum())
                    for chain, spin in zip(chains, spins, strict=True)
                ]
            ),
            mass=np.array([beam.mass_kg for beam in beams]),
            passes=np.array([lowest_pass(beam, sigma_rad)[0] for beam in beams]),
        )


def lowest_pass(beam: BeamParams, sigma_rad: float) -> tuple[float, int]:
    """Return V_σ = min of U over ‖z2‖∞ = σ, J, and the segment that is at σ there.

    U is convex within σ ≤ π/3, so each face has one minimum; by symmetry one of two faces does.

    Raises:
        CertificateError: the energy of the beam does not rise towards σ.
    """
    model = HangingBeam(beam)
    p, K = model.chain.constants.first_moments, model.k_o22

    def energy(swing: Array) -> tuple[float, Array]:
        potential = GRAVITY_M_S2 * (p * (1 - np.cos(swing))).sum() + 0.5 * swing @ K @ swing
        return float(potential), GRAVITY_M_S2 * p * np.sin(swing) + K @ swing

    scale = energy(np.full(len(p), sigma_rad))[0]
    if not scale > 0:
        raise CertificateError(
            "beam", beam, "one that hangs, or is sprung", "Give it mass, length or stiffness."
        )
    lowest = []
    for face in range(len(p)):
        bounds = [(-sigma_rad, sigma_rad)] * len(p)
        bounds[face] = (sigma_rad, sigma_rad)
        found = minimize(
            lambda swing: tuple(part / scale for part in energy(swing)),
            np.full(len(p), sigma_rad),
            jac=True,
            bounds=bounds,
            method="L-BFGS-B",
            options={"ftol": 1e-15, "gtol": 1e-12, "maxiter": 1000},
        )
        lowest.append(float(found.fun) * scale)
    segment = int(np.argmin(lowest))
    return lowest[segment], segment


class StorageRoom(NamedTuple):
    """Where one state of the object is stepped.

    Attributes:
        swing: φ at the end of the step, (N,) rad.
        swing_rate: φ̇ at its end, (N,) rad/s.
        middle: φ in its middle, (N,) rad.
        rate: φ̇ there, (N,) rad/s.
        cosine: cos φ, (N,).
        sine: sin φ, (N,).
        M: (N, N).
    """

    swing: Array
    swing_rate: Array
    middle: Array
    rate: Array
    cosine: Array
    sine: Array
    M: Array

    @classmethod
    def empty(cls, segments: int) -> StorageRoom:
        """Return room for N segments."""
        shapes = ((segments,),) * 6 + ((segments, segments),)
        return cls(*(np.empty(shape) for shape in shapes))


@compilable
def swing_step(
    model: StorageModel,
    c: int,
    swing: Array,
    swing_rate: Array,
    forward: float,
    upward: float,
    yaw_rate: float,
    period_s: float,
    room: StorageRoom,
) -> None:
    """Write φ and φ̇ after a period of constant acceleration into ``room``.

    The midpoint rule, implicit in springs and dampers, so that stiff ones neither gain nor need
    small steps. ``room.middle``, ``room.rate`` and the cosines and sines there are left
    for :func:`power_of`.

    Args:
        model: of the beams.
        c: which of them.
        swing: φ, (N,) rad.
        swing_rate: φ̇, (N,) rad/s.
        forward: grasp acceleration in the base frame, m/s².
        upward: likewise.
        yaw_rate: u2, rad/s.
        period_s: of the step.
        room: the result.
    """
    half, count = 0.5 * period_s, len(swing)
    for j in range(count):
        room.middle[j] = swing[j] + half * swing_rate[j]
        room.cosine[j], room.sine[j] = cos(room.middle[j]), sin(room.middle[j])
    for j in range(count):
        torque = model.moments[c, j] * (
            (GRAVITY_M_S2 + upward) * room.sine[j] + forward * room.cosine[j]
        )
        torque -= yaw_rate**2 * model.spin[c, j] * room.sine[j] * room.cosine[j]
        momentum = 0.0
        for k in range(count):
            W = model.coupling[c, j, k]
            turned = room.cosine[j] * room.cosine[k] + room.sine[j] * room.sine[k]
            room.M[j, k] = W * turned + half**2 * model.stiffness[c, j, k]
            room.M[j, k] += half * model.damping[c, j, k]
            momentum += W * turned * swing_rate[k]
            turned = room.sine[j] * room.cosine[k] - room.cosine[j] * room.sine[k]
            torque += W * turned * swing_rate[k] ** 2
            torque -= yaw_rate**2 * W * room.cosine[j] * room.sine[k]
            torque += model.stiffness[c, j, k] * swing[k]
        room.M[j, j] += model.inertia[c, j]
        room.rate[j] = momentum + model.inertia[c, j] * swing_rate[j] - half * torque
    solve_positive_definite(room.M, room.rate, 0)
    for j in range(count):
        room.swing[j] = swing[j] + period_s * room.rate[j]
        room.swing_rate[j] = 2 * room.rate[j] - swing_rate[j]


@compilable
def storage_at(
    model: StorageModel, c: int, swing: Array, swing_rate: Array, yaw_rate: float, room: StorageRoom
) -> float:
    """Return B of one state, J; cosines and sines of ``room`` become those of this state.

    Args:
        model: of the beams.
        c: which of them.
        swing: φ, (N,) rad.
        swing_rate: φ̇, (N,) rad/s.
        yaw_rate: u2, rad/s.
        room: for intermediate results.
    """
    count = len(swing)
    for j in range(count):
        room.cosine[j], room.sine[j] = cos(swing[j]), sin(swing[j])
    stored = 0.5 * yaw_rate**2 * model.yaw_inertia[c]
    for j in range(count):
        stored += 0.5 * model.inertia[c, j] * swing_rate[j] ** 2
        stored += GRAVITY_M_S2 * model.moments[c, j] * (1.0 - room.cosine[j])
        stored -= 0.5 * yaw_rate**2 * model.spin[c, j] * room.sine[j] ** 2
        for k in range(count):
            W = model.coupling[c, j, k]
            turned = room.cosine[j] * room.cosine[k] + room.sine[j] * room.sine[k]
            stored += 0.5 * W * turned * swing_rate[j] * swing_rate[k]
            stored -= 0.5 * yaw_rate**2 * W * room.sine[j] * room.sine[k]
            stored += 0.5 * model.stiffness[c, j, k] * swing[j] * swing[k]
    return stored


@compilable
def power_of(model: StorageModel, c: int, room: StorageRoom) -> tuple[float, float, float]:
    """Return s_f, s_u, kg·m/s, and I_σ − I_z, kg·m², in the middle of the step in ``room``."""
    forward = upward = 0.0
    inertia = model.yaw_inertia[c]
    for j in range(len(room.rate)):
        forward += model.moments[c, j] * room.cosine[j] * room.rate[j]
        upward += model.moments[c, j] * room.sine[j] * room.rate[j]
        inertia -= model.spin[c, j] * room.sine[j] ** 2
        for k in range(len(room.rate)):
            inertia -= model.coupling[c, j, k] * room.sine[j] * room.sine[k]
    return forward, upward, inertia


@compilable
def uncertain_storage(
    model: StorageModel, c: int, uncertainty: Array, i: int, room: StorageRoom
) -> float:
    """Return how much more than in ``room`` may be stored, J, if angles are uncertain.

    Args:
        model: of the beams.
        c: which of them.
        uncertainty: of the swing, (n, N) rad.
        i: which state.
        room: what ``storage_at`` left of that state's swing, which is in ``room.swing``.
    """
    more = 0.0
    for j in range(len(room.swing)):
        slope = GRAVITY_M_S2 * model.moments[c, j] * abs(room.sine[j])
        for k in range(len(room.swing)):
            slope += abs(model.stiffness[c, j, k] * room.swing[k])
            curvature = abs(model.stiffness[c, j, k]) * uncertainty[i, k]
            more += 0.5 * curvature * uncertainty[i, j]
        curvature = GRAVITY_M_S2 * model.moments[c, j] * uncertainty[i, j]
        more += (slope + 0.5 * curvature) * uncertainty[i, j]
    return more
