"""Settings of ``defmanip certify``; their docstrings are the command line's help."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from defmanip_gym.params import BeamParams, validated_sigma
from defmanip_gym.theory.certificates.conditions import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.payload.elastic_beam import elastic_beam
from defmanip_gym.validation import require_flag, require_number, settle


@dataclass(frozen=True, kw_only=True)
class CertifyConfig:
    """Compute every bound on the grasp's acceleration for an object, and attack the tightest.

    For beams, damped or not, it also tells what filters that measure the swing keep.

    The object is a beam of rigid segments (the default is the paper's), an elastic beam where
    --bending-stiffness is given, or what an MJCF file holds.

    Examples:
        defmanip certify --damping 1.0

        defmanip certify --damping 0

        defmanip certify --segments 3 --joint-stiffness 3 --damping-interval 0.5 2

        defmanip certify --length 1.2 --mass 0.5 --bending-stiffness 0.4 --segments 6

        defmanip certify --mjcf hose.xml --grasp-site grasp --vertical-acceleration 0.2

        defmanip certify --transport
    """

    mjcf: Path | None = None
    """Model file of the object; options for beams are then ignored."""
    grasp_site: str = "grasp"
    """Site at which the object of the model file is held."""
    length: float = 0.6
    """Beam length, m."""
    mass: float = 3.1153
    """Beam mass, kg."""
    segments: int = 1
    """Rigid segments that the beam is cut into."""
    damping: float | None = None
    """Damping of the first segment from the vertical, N m s/rad (0.1; elastic: from its ratio)."""
    joint_stiffness: float = 20.0
    """Stiffness between segments, N m/rad."""
    joint_damping: float = 0.2
    """Damping between segments, N m s/rad."""
    root_stiffness: float = 0.0
    """Stiffness of the first segment from the vertical, N m/rad."""
    bending_stiffness: float | None = None
    """EI in N m² of an elastic beam; stiffnesses and dampings then follow from it."""
    damping_ratio: float = 0.05
    """Damping ratio of an elastic beam's first mode."""
    root: Literal["clamped", "pinned"] = "clamped"
    """How an elastic beam is held."""
    sigma: float = math.pi / 6
    """Admissible deformation of each internal coordinate, rad (m for slides)."""
    damping_interval: tuple[float, float] = (1.0, 1.0)
    """Lowest and highest factor on the damping for which the bounds must hold."""
    stiffness_interval: tuple[float, float] = (1.0, 1.0)
    """The same for the elastic stiffness."""
    vertical_acceleration: float = 0.0
    """Vertical acceleration to allow, m/s²."""
    yaw_rate: float = 0.0
    """Yaw rate to allow, rad/s."""
    initial_swing: float = 0.0
    """Initial deformation of each coordinate to allow, rad."""
    initial_swing_rate: float = 0.0
    """Initial rate of each coordinate to allow, rad/s."""
    acceleration_error: float = 0.0
    """How far the forward acceleration may be from its command, m/s²."""
    transport: bool = False
    """Allow what the transport task needs (TRANSPORT_CONDITIONS) instead of the values above."""
    attack: bool = True
    """Search for the worst input on the MuJoCo plant, seconds to a minute."""
    longest_attack_s: float = 60.0
    """Longest attack, simulated seconds."""
    output: Path = Path("results/certify")
    """Folder for the plot and the numbers."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigma", validated_sigma(self.sigma))
        settle(self, "transport", require_flag)
        settle(self, "attack", require_flag)
        settle(self, "longest_attack_s", require_number, 1.0, 3600.0, "s")
        _ = self.intervals, self.conditions  # checks the rest
        if self.mjcf is None:
            _ = self.beam

    @property
    def beam(self) -> BeamParams:
        """The beam that the options describe."""
        if self.bending_stiffness is not None:
            return elastic_beam(
                length_m=self.length,
                mass_kg=self.mass,
                bending_stiffness_n_m2=self.bending_stiffness,
                damping_ratio=self.damping_ratio,
                segment_count=self.segments,
                root=self.root,
                damping=self.damping,
            )
        return BeamParams(
            mass_kg=self.mass,
            length_m=self.length,
            damping=BeamParams().damping if self.damping is None else self.damping,
            segment_count=self.segments,
            joint_stiffness=self.joint_stiffness,
            joint_damping=self.joint_damping,
            root_stiffness=self.root_stiffness,
        )

    @property
    def intervals(self) -> ParameterIntervals:
        """Intervals of damping and stiffness."""
        return ParameterIntervals(damping=self.damping_interval, stiffness=self.stiffness_interval)

    @property
    def conditions(self) -> CertificateConditions:
        """Conditions of the motion, from the single options."""
        return CertificateConditions(
            vertical_acceleration_m_s2=self.vertical_acceleration,
            yaw_rate_rad_s=self.yaw_rate,
            initial_swing_rad=self.initial_swing,
            initial_swing_rate_rad_s=self.initial_swing_rate,
            acceleration_error_m_s2=self.acceleration_error,
        )

    @property
    def command(self) -> str:
        """The shell command that computes this ladder."""
        words = ["defmanip", "certify"]
        for field in fields(self):
            value = getattr(self, field.name)
            option = field.name.replace("_", "-")
            if value == field.default:
                continue
            if isinstance(value, bool):
                words.append(f"--{option}" if value else f"--no-{option}")
            else:
                values = value if isinstance(value, tuple) else (value,)
                words += [f"--{option}", *map(str, values)]
        return shlex.join(words)
