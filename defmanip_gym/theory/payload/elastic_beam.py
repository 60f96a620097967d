"""Elastic beams cut into rigid segments: springs and dampers from bending stiffness.

A hinge between two segments of length s = L/N stands for the bend of the half segments on its two
sides, EI over the length s. A clamped root stands for one half segment: 2 EI/s. With uniform rods
between the hinges the natural frequencies approach Euler–Bernoulli's with the square of 1/N from
below (tests/theory/payload/test_elastic_beam.py).
"""

from __future__ import annotations

import math
from typing import Literal

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.validation import (
    require_choice,
    require_non_negative,
    require_positive,
    require_whole,
)

Root = Literal["clamped", "pinned"]

# (β L) of the first elastic modes: roots of cos x cosh x = −1 and of tan x = tanh x
FIRST_WAVE_NUMBERS: dict[str, float] = {"clamped": 1.8751040687, "pinned": 3.9266023120}


def first_elastic_frequency(
    *, length_m: float, mass_kg: float, bending_stiffness_n_m2: float, root: Root
) -> float:
    """Return ω_1 = (βL)² √(EI / (m L³)) of an Euler–Bernoulli beam without gravity, rad/s."""
    return FIRST_WAVE_NUMBERS[root] ** 2 * math.sqrt(
        bending_stiffness_n_m2 / (mass_kg * length_m**3)
    )


def elastic_beam(
    *,
    length_m: float,
    bending_stiffness_n_m2: float,
    damping_ratio: float,
    segment_count: int,
    mass_kg: float | None = None,
    density_kg_m3: float | None = None,
    root: Root = "clamped",
    radius_m: float = 0.02,
    damping: float | None = None,
) -> BeamParams:
    """Return a beam of N segments that bends like an elastic one.

    Its dampers are proportional to its springs, so the ratio of the k-th elastic mode grows like
    ω_k: ζ_k = ζ_1 ω_k / ω_1.

    Args:
        length_m: L.
        bending_stiffness_n_m2: EI, N m².
        damping_ratio: ζ_1 of the first elastic mode without gravity.
        segment_count: N; a pinned beam needs 2 to bend at all.
        mass_kg: mass; or give the density.
        density_kg_m3: density of a round beam of ``radius_m``.
        root: ``"clamped"`` holds the direction of the root vertical, ``"pinned"`` lets it swing.
        radius_m: radius; it does not enter the bending stiffness.
        damping: damper of the first segment from the vertical, N m s/rad, besides what a clamped
            root brings along. By default 0 for a clamped root, and for a pinned one what damps its
            swing under gravity, which bends it too little to be damped otherwise, with
            ``damping_ratio``.
    """
    length_m = require_positive("length_m", length_m, "m")
    bending_stiffness_n_m2 = require_positive(
        "bending_stiffness_n_m2", bending_stiffness_n_m2, "N m²"
    )
    damping_ratio = require_non_negative("damping_ratio", damping_ratio)
    require_choice("root", root, tuple(FIRST_WAVE_NUMBERS))
    segment_count = require_whole("segment_count", segment_count, 1 if root == "clamped" else 2)
    mass = _mass(mass_kg, density_kg_m3, length_m, radius_m)
    frequency = first_elastic_frequency(
        length_m=length_m,
        mass_kg=mass,
        bending_stiffness_n_m2=bending_stiffness_n_m2,
        root=root,
    )
    joint_stiffness = bending_stiffness_n_m2 * segment_count / length_m
    root_stiffness = 2 * joint_stiffness if root == "clamped" else 0.0
    damping_per_stiffness = 2 * damping_ratio / frequency
    if damping is None:
        damping = 0.0 if root == "clamped" else _swing_damping(length_m, mass, damping_ratio)
    damping = require_non_negative("damping", damping, "N m s/rad")
    return BeamParams(
        mass_kg=mass,
        length_m=length_m,
        damping=damping + damping_per_stiffness * root_stiffness,
        segment_count=segment_count,
        joint_stiffness=joint_stiffness,
        joint_damping=damping_per_stiffness * joint_stiffness,
        root_stiffness=root_stiffness,
        radius_m=radius_m,
    )


def _mass(
    mass_kg: float | None, density_kg_m3: float | None, length_m: float, radius_m: float
) -> float:
    if (mass_kg is None) == (density_kg_m3 is None):
        raise ParameterError(
            "mass_kg",
            mass_kg,
            "either mass_kg or density_kg_m3",
            f"Give exactly one of them; density_kg_m3 is {density_kg_m3!r}.",
        )
    if mass_kg is not None:
        return require_positive("mass_kg", mass_kg, "kg")
    density_kg_m3 = require_positive("density_kg_m3", density_kg_m3, "kg/m³")
    radius_m = require_positive("radius_m", radius_m, "m")
    return density_kg_m3 * math.pi * radius_m**2 * length_m


def _swing_damping(length_m: float, mass_kg: float, damping_ratio: float) -> float:
    """Return 2 ζ J ω of the rigid beam swinging under gravity."""
    inertia = mass_kg * length_m**2 / 3
    return 2 * damping_ratio * inertia * math.sqrt(1.5 * GRAVITY_M_S2 / length_m)
