"""Whether an object on the rig is the one in its file: their motion compared, state by state."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STATES, _DEFLECTION = 4, 0.3  # rad, m and per s
_TOLERANCE, _ROUNDING = 1e-8, 1e-12  # of the largest entry, and in any unit


def differences(held: mujoco.MjModel, grasp_m: Array, rig: mujoco.MjModel) -> list[str]:
    """Return what differs, in words, between an object held still and the same on a rig.

    Args:
        held: the object alone, its root held still.
        grasp_m: where it is held there, (3,).
        rig: the rig with the object, on a carriage of no inertia.
    """
    rng = np.random.default_rng(0)
    states = _DEFLECTION * rng.uniform(-1, 1, (_STATES, 2, held.nv))
    states[0] = 0.0
    expected, found = _terms(held, states, root=1), _terms(rig, states, root=2)
    expected["centre of mass"] -= grasp_m
    return [name for name in expected if not _agree(found[name], expected[name])]


def _agree(found: Array, expected: Array) -> bool:
    largest = float(np.abs(expected).max(initial=0.0))
    return float(np.abs(found - expected).max(initial=0.0)) <= _TOLERANCE * largest + _ROUNDING


def _terms(model: mujoco.MjModel, states: Array, *, root: int) -> dict[str, Array]:
    """Return the terms of Eq. (6b) in each state, for the body ``root`` and those below it."""
    rows = [_terms_in(model, offset, velocity, root) for offset, velocity in states]
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _terms_in(model: mujoco.MjModel, offset: Array, velocity: Array, root: int) -> dict[str, Array]:
    data, inner = mujoco.MjData(model), slice(model.nv - len(offset), None)
    data.qpos[inner] = model.qpos0[inner] + offset
    data.qvel[inner] = velocity
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return {
        "mass": model.body_mass[root:].sum(keepdims=True),
        "centre of mass": data.subtree_com[root].copy(),
        "inertia": inertia[inner, inner],
        "weight": (data.qfrc_bias - data.qfrc_gravcomp)[inner],
        "stiffness": data.qfrc_spring[inner],
        "damping": data.qfrc_damper[inner],
    }
