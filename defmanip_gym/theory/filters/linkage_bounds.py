"""V_σ, I_σ, μ and the largest momenta of an object of links, by search over ‖z2‖∞ ≤ σ."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy.optimize import minimize

from defmanip_gym.compiled import compiled
from defmanip_gym.errors import CertificateError
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.linkage_storage import (
    LinkageModel,
    LinkageStorageRoom,
    linkage_storage,
    yaw_inertia,
)
from defmanip_gym.theory.payload.linkage import Linkage, place
from defmanip_gym.theory.payload.linkage_motion import along_joint, push, weigh

_STARTS = 8  # of the search on each face
_RAYS, _ROUNDS = 512, 12  # of the search for the largest within V_σ
_SPARE = 1.02  # on what was found


class LinkageBounds(NamedTuple):
    """What was found of an object.

    Attributes:
        equilibrium: z2*, (N,).
        coordinate: index of the one that is at σ at the lowest pass.
        momenta: the largest s forward, left and up within V ≤ V_σ, (3,) kg·m/s.
        slowest_rad_s: lowest natural frequency about z2*.
    """

    equilibrium: Array
    coordinate: int
    momenta: Array
    slowest_rad_s: float


@compiled
def _look(
    model: LinkageModel,
    z2: Array,
    room: LinkageStorageRoom,
    potentials: Array,
    slopes: Array,
    matrices: Array,
    couplings: Array,
    inertias: Array,
) -> None:
    """Write U, its slope, m_o22, m_o12 with m_y below it, and I_z of n configurations (n, N)."""
    motion, links = room.motion, room.links
    for i in range(len(z2)):
        for j in range(len(room.rate)):
            room.swing[j], room.rate[j] = z2[i, j], 0.0
        potentials[i] = linkage_storage(model, 0, room.swing, room.rate, 0.0, room)
        place(model.linkage, room.swing, links)
        weigh(model.linkage, links, motion)
        push(model.linkage, links, room.rate, (0.0, 0.0, 0.0), 0.0, 0.0, motion)
        inertias[i] = yaw_inertia(model.linkage, links)
        for j in range(len(room.rate)):
            slope = along_joint(model.linkage, j, links, motion.force[j], motion.torque[j])
            slope -= model.linkage.preload[j]
            for k in range(len(room.rate)):
                slope += model.linkage.stiffness[j, k] * room.swing[k]
                matrices[i, j, k] = motion.M[j, k]
            slopes[i, j] = slope
            for k in range(3):
                couplings[i, k, j] = motion.momentum[j, k]
            couplings[i, 3, j] = motion.spin[j, 2]


class Seen(NamedTuple):
    """Of n configurations: U (n,), ∂U (n, N), m_o22 (n, N, N), (m_o12, m_y) (n, 4, N), I_z (n,)."""

    potential: Array
    slope: Array
    matrix: Array
    coupling: Array
    yaw_inertia: Array


def look(model: LinkageModel, z2: Array) -> Seen:
    """Return what an object is like at n configurations (n, N)."""
    (n, N), room = z2.shape, LinkageStorageRoom.empty(z2.shape[1])
    shapes = ((n,), (n, N), (n, N, N), (n, 4, N), (n,))
    seen = Seen(*(np.empty(shape) for shape in shapes))
    _look(model, np.ascontiguousarray(z2, dtype=np.float64), room, *seen)
    return seen


def bounded(
    linkage: Linkage, mass_kg: float, sigma_rad: float
) -> tuple[LinkageModel, LinkageBounds]:
    """Return the model of an object within σ, and what was found of it.

    Raises:
        CertificateError: it does not hang within σ, or its energy does not rise towards it.
    """
    zero = np.zeros(1)
    model = LinkageModel(linkage, zero, zero, zero, np.array([mass_kg]), zero, np.full(1, np.inf))
    equilibrium = _equilibrium(model, sigma_rad)
    model = model._replace(lowest=look(model, equilibrium[None]).potential)
    coordinate, pass_j = _lowest_pass(model, equilibrium, sigma_rad)
    found = _largest_within(model, equilibrium, pass_j, sigma_rad)
    model = model._replace(
        yaw_inertia=found[4:5], yaw_momentum=found[3:4], passes=np.array([pass_j])
    )
    slowest_rad_s = float(linkage_modes(model, equilibrium)[0][0])
    return model, LinkageBounds(equilibrium, coordinate, found[:3], slowest_rad_s)


def _energy(model: LinkageModel, z2: Array) -> tuple[float, Array]:
    seen = look(model, z2[None])
    return float(seen.potential[0]), seen.slope[0]


def _equilibrium(model: LinkageModel, sigma: float) -> Array:
    """Return the minimum of U from where the joints are at rest."""
    count = len(model.linkage.mass)
    start = np.clip(model.linkage.rest, -sigma, sigma)
    options = {"ftol": 1e-15, "gtol": 1e-11, "maxiter": 2000}
    found = minimize(
        lambda z2: _energy(model, z2),
        start,
        jac=True,
        bounds=[(-sigma, sigma)] * count,
        method="L-BFGS-B",
        options=options,
    )
    equilibrium: Array = np.asarray(found.x, dtype=np.float64)
    if not np.abs(equilibrium).max() < sigma:
        raise CertificateError(
            "equilibrium of the object",
            np.array2string(equilibrium, precision=4),
            f"coordinates within ±{sigma:.4g}",
            "Use a larger sigma_rad, or build the object as it hangs.",
        )
    return equilibrium


def _lowest_pass(model: LinkageModel, equilibrium: Array, sigma: float) -> tuple[int, float]:
    """Return coordinate and height of the lowest pass out of σ, J."""
    rng, count = np.random.default_rng(0), len(equilibrium)
    lowest, where = math.inf, 0
    for face in range(count):
        for side in (-sigma, sigma):
            bounds = [(-sigma, sigma)] * count
            bounds[face] = (side, side)
            starts = rng.uniform(-sigma, sigma, (_STARTS, count))
            starts[0] = equilibrium
            starts[:, face] = side
            for start in starts:
                found = minimize(
                    lambda z2: _energy(model, z2),
                    start,
                    jac=True,
                    bounds=bounds,
                    method="L-BFGS-B",
                    options={"ftol": 1e-13},
                )
                if found.fun < lowest:
                    lowest, where = float(found.fun), face
    if not lowest > 0:
        raise CertificateError(
            "V_σ of the object",
            lowest,
            "an energy above that of the equilibrium",
            "There is no pass within σ: use another sigma_rad, or stiffer joints.",
        )
    return where, lowest


def _largest_within(model: LinkageModel, rest: Array, pass_j: float, sigma: float) -> Array:
    """Return the largest |s| forward, left, up, |m_yᵀ ż2| and I_z within V ≤ V_σ, (5,)."""
    rng, count = np.random.default_rng(1), len(rest)
    ways = rng.normal(size=(_RAYS, count))
    shares = rng.uniform(0, 1, _RAYS)
    best = np.full(5, -np.inf)
    for step in range(_ROUNDS):
        z2 = _inside(model, rest, pass_j, sigma, ways, shares)
        values = _quantities(look(model, z2), pass_j)
        places = np.argmax(values, axis=0)
        best = np.maximum(best, values.max(axis=0))
        # on around the best ones
        size = 0.5**step
        chosen = np.resize(places, _RAYS)
        ways = _unit(ways)[chosen] + size * rng.normal(size=(_RAYS, count)) / math.sqrt(count)
        shares = np.clip(shares[chosen] + size * rng.uniform(-1, 1, _RAYS), 0.0, 1.0)
        ways[:5], shares[:5] = _unit(ways)[:5], shares[:5]
    return _SPARE * best


def _unit(ways: Array) -> Array:
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def _inside(
    model: LinkageModel, rest: Array, pass_j: float, sigma: float, ways: Array, shares: Array
) -> Array:
    """Return configurations (n, N) at shares of the way on rays to the end of U ≤ V_σ."""
    ways = _unit(ways)
    with np.errstate(divide="ignore"):
        ends = (np.where(ways > 0, sigma, -sigma) - rest) / ways
    low, high = np.zeros(len(ways)), np.where(ways == 0, np.inf, ends).min(axis=1)
    for _ in range(30):
        middle = 0.5 * (low + high)
        below = look(model, rest + middle[:, None] * ways).potential <= pass_j
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return rest + (shares * low)[:, None] * ways


def _quantities(seen: Seen, pass_j: float) -> Array:
    """Return the largest momenta that the energy left allows, (n, 4), and I_z: (n, 5)."""
    left = np.maximum(pass_j - seen.potential, 0.0)
    answers = np.linalg.solve(seen.matrix, seen.coupling.swapaxes(1, 2))
    squares = np.einsum("nij,nji->ni", seen.coupling, answers)
    momenta = np.sqrt(2 * left[:, None] * np.maximum(squares, 0.0))
    return np.concatenate((momenta, seen.yaw_inertia[:, None]), axis=1)


def linkage_modes(model: LinkageModel, rest: Array) -> tuple[Array, Array]:
    """Return natural frequencies, (N,) rad/s, ascending, and shapes, (N, N), about z2*."""
    step = 1e-5
    ahead = look(model, rest + step * np.eye(len(rest))).slope
    behind = look(model, rest - step * np.eye(len(rest))).slope
    stiffness = (ahead - behind) / (2 * step)
    matrix = look(model, rest[None]).matrix[0]
    squares, shapes = scipy.linalg.eigh(0.5 * (stiffness + stiffness.T), matrix)
    return np.sqrt(np.maximum(squares, 1e-12)), shapes
