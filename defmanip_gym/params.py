"""Physical parameters: frozen, keyword-only, validated when constructed.

Units stand in the names (``_m``, ``_kg``, ``_s``, ``_rad``; dampings in N·m·s/rad, stiffnesses in
N·m/rad). Every constructor takes NumPy's numbers and arrays as well, keeps Python's own, and raises
:class:`~defmanip_gym.errors.ParameterError`. The ranges are those of anything that a robot carries:
beyond them physics and integrals cost too much or overflow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import (
    require_between,
    require_non_negative,
    require_number,
    require_params,
    require_range,
    require_whole,
    settle,
)

if TYPE_CHECKING:  # parameters are plain numbers; only sampling mentions NumPy
    import numpy as np

GRAVITY_M_S2 = 9.81

# The damping that the paper designs with (Section VI); its simulated beam has a tenth of it.
DESIGN_DAMPING = 1.0

# Beyond this angle the linearization (16) says nothing useful about the beam.
LARGEST_SIGMA_RAD = math.pi / 3

# (low, high): what bodies, limits and objects may be
_LENGTHS_M = (0.01, 100.0)
_RADII_M = (1e-4, 10.0)
_MASSES_KG = (1e-3, 1e5)
_INERTIAS_KGM2 = (1e-4, 1e5)
_FORCES_N = (1e-3, 1e6)
_DAMPINGS = (0.0, 1e4)
_STIFFNESSES = (0.0, 1e6)
_MOST_SEGMENTS = 64


def validated_sigma(sigma_rad: float) -> float:
    """Return σ, the admissible deformation of Eq. (9), or raise ParameterError."""
    return require_between(
        "sigma_rad",
        sigma_rad,
        0.0,
        LARGEST_SIGMA_RAD,
        remedy="The bounds linearize about hanging at rest; choose a σ below 60 degrees.",
    )


def _require_slender(name: str, radius_m: object, length_m: float) -> float:
    """Return a radius for which a body with the inertias m l²/12, m l²/12, m r²/2 exists."""
    radius = require_number(name, radius_m, *_RADII_M, "m")
    return require_between(
        name,
        radius,
        0.0,
        length_m / math.sqrt(3),
        remedy="Take a thinner or longer rod, or fewer segments; links are slender rods.",
    )


@dataclass(frozen=True, kw_only=True)
class LinkParams:
    """A uniform arm link: a rod of length, mass and radius."""

    length_m: float
    mass_kg: float
    radius_m: float = 0.04

    def __post_init__(self) -> None:
        settle(self, "length_m", require_number, *_LENGTHS_M, "m")
        settle(self, "mass_kg", require_number, *_MASSES_KG, "kg")
        settle(self, "radius_m", _require_slender, self.length_m)


@dataclass(frozen=True, kw_only=True)
class RobotParams:
    """A unicycle base carrying a two-joint arm that moves in the vertical plane of its heading.

    The limits are those of the generalized forces T_r = (f_b, α_b, τ1, τ2) of Eq. (2).
    """

    base_mass_kg: float = 50.0
    base_yaw_inertia_kgm2: float = 2.5
    shoulder_height_m: float = 0.4
    upper_arm: LinkParams = field(default_factory=lambda: LinkParams(length_m=0.6, mass_kg=5.0))
    forearm: LinkParams = field(default_factory=lambda: LinkParams(length_m=0.7, mass_kg=3.0))
    joint_armature_kgm2: float = 1.0
    drive_force_limit_n: float = 400.0
    steering_torque_limit_nm: float = 120.0
    shoulder_torque_limit_nm: float = 250.0
    elbow_torque_limit_nm: float = 150.0

    def __post_init__(self) -> None:
        settle(self, "upper_arm", require_params, LinkParams)
        settle(self, "forearm", require_params, LinkParams)
        settle(self, "base_mass_kg", require_number, *_MASSES_KG, "kg")
        settle(self, "base_yaw_inertia_kgm2", require_number, *_INERTIAS_KGM2, "kg m²")
        settle(self, "shoulder_height_m", require_number, *_LENGTHS_M, "m")
        settle(self, "joint_armature_kgm2", require_number, 0.0, _INERTIAS_KGM2[1], "kg m²")
        for name in (
            "drive_force_limit_n",
            "steering_torque_limit_nm",
            "shoulder_torque_limit_nm",
            "elbow_torque_limit_nm",
        ):
            settle(self, name, require_number, *_FORCES_N)

    @property
    def force_limits(self) -> tuple[float, float, float, float]:
        """Largest |T_r|: (N, N·m, N·m, N·m)."""
        return (
            self.drive_force_limit_n,
            self.steering_torque_limit_nm,
            self.shoulder_torque_limit_nm,
            self.elbow_torque_limit_nm,
        )


@dataclass(frozen=True, kw_only=True)
class BeamParams:
    """A uniform beam hanging from the grasp, cut into equal rigid segments joined by hinges.

    ``damping`` and ``root_stiffness`` act on the first segment's swing measured from the vertical;
    the joint values act between neighbouring segments. The default is the reference beam: with
    ``damping=1.0`` it reproduces the paper's ν_max, and 0.1 is what the paper simulates.
    """

    mass_kg: float = 3.1153
    length_m: float = 0.6
    damping: float = 0.1
    segment_count: int = 1
    joint_stiffness: float = 20.0
    joint_damping: float = 0.2
    root_stiffness: float = 0.0
    radius_m: float = 0.02

    def __post_init__(self) -> None:
        settle(self, "mass_kg", require_number, *_MASSES_KG, "kg")
        settle(self, "length_m", require_number, *_LENGTHS_M, "m")
        settle(self, "damping", require_number, *_DAMPINGS, "N m s/rad")
        settle(self, "segment_count", require_whole, 1, _MOST_SEGMENTS)
        settle(self, "joint_stiffness", require_number, *_STIFFNESSES, "N m/rad")
        settle(self, "joint_damping", require_number, *_DAMPINGS, "N m s/rad")
        settle(self, "root_stiffness", require_number, *_STIFFNESSES, "N m/rad")
        settle(self, "radius_m", _require_slender, self.segment_length_m)

    @property
    def segment_mass_kg(self) -> float:
        """Mass of one segment."""
        return self.mass_kg / self.segment_count

    @property
    def segment_length_m(self) -> float:
        """Length of one segment."""
        return self.length_m / self.segment_count


@dataclass(frozen=True, kw_only=True)
class BeamRanges:
    """Ranges (low, high), ends included, from which every episode draws its beam uniformly.

    Each replaces the beam's own value; None keeps it.
    """

    damping: tuple[float, float] | None = None
    mass_kg: tuple[float, float] | None = None
    length_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name, ends, unit in (
            ("damping", _DAMPINGS, "N m s/rad"),
            ("mass_kg", _MASSES_KG, "kg"),
            ("length_m", _LENGTHS_M, "m"),
        ):
            if getattr(self, name) is not None:
                settle(self, name, require_range, *ends, unit)

    @property
    def is_empty(self) -> bool:
        """Whether every beam keeps all its values."""
        return self.damping is None and self.mass_kg is None and self.length_m is None

    def require_fit(self, beam: BeamParams) -> None:
        """Raise ParameterError if a beam with a length from the range would be too stubby."""
        if self.length_m is None:
            return
        try:
            replace(beam, length_m=self.length_m[0])
        except ParameterError as error:
            raise ParameterError(
                "length_m",
                self.length_m,
                f"a range whose low end allows radius_m={beam.radius_m:g} in each of "
                f"{beam.segment_count} segments: {error.allowed}",
                "Raise the low end, or take a thinner beam or fewer segments.",
            ) from error

    def extremes(self, beam: BeamParams) -> tuple[BeamParams, ...]:
        """Return ``beam`` with all combinations of the ranges' ends."""
        ends = {name: getattr(self, name) for name in self.__dataclass_fields__}
        varied = {name: pair for name, pair in ends.items() if pair is not None}
        return tuple(
            replace(beam, **dict(zip(varied, values, strict=True)))
            for values in product(*varied.values())
        )

    def sample(self, beam: BeamParams, generator: np.random.Generator) -> BeamParams:
        """Return ``beam`` with new values for those that have a range.

        The order of the draws is fixed: damping, mass, length, each only if it has a range.
        """
        self.require_fit(beam)

        def draw(ends: tuple[float, float] | None, own: float) -> float:
            return own if ends is None else float(generator.uniform(*ends))

        return replace(
            beam,
            damping=draw(self.damping, beam.damping),
            mass_kg=draw(self.mass_kg, beam.mass_kg),
            length_m=draw(self.length_m, beam.length_m),
        )


@dataclass(frozen=True, kw_only=True)
class DisturbanceParams:
    """What disturbs the robot: forces at the grasp and noise in its sensors.

    The force ``force_amplitude_n · sin(force_frequency_rad_s · t) + force_bias_n`` acts on the end
    effector along each axis of the base frame, as in the paper's Section VI (0.005 sin t, 0.05 N).
    The noises are the standard deviations of Gaussians added to the observed grasp force (each
    axis) and swing angles (each segment).
    """

    force_amplitude_n: float = 0.0
    force_frequency_rad_s: float = 1.0
    force_bias_n: float = 0.0
    force_sensor_noise_n: float = 0.0
    swing_sensor_noise_rad: float = 0.0

    def __post_init__(self) -> None:
        for name in ("force_amplitude_n", "force_bias_n"):
            settle(self, name, require_number, -1e4, 1e4, "N")
        settle(self, "force_frequency_rad_s", require_non_negative, "rad/s")
        settle(self, "force_sensor_noise_n", require_non_negative, "N")
        settle(self, "swing_sensor_noise_rad", require_non_negative, "rad")

    @property
    def has_force(self) -> bool:
        """Whether any force acts on the end effector."""
        return self.force_amplitude_n != 0.0 or self.force_bias_n != 0.0


PAPER_DISTURBANCE = DisturbanceParams(force_amplitude_n=0.005, force_bias_n=0.05)
