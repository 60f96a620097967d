"""What is attacked: an object on its rig, its linearization, and the inputs that are admissible."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defmanip_gym.errors import ParameterError
from defmanip_gym.objects.mjcf_object import MjcfObject
from defmanip_gym.params import BeamParams
from defmanip_gym.plant.rig_model import RigModel, beam_rig
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, linearize
from defmanip_gym.validation import require_non_negative, settle

FORWARD, LEFT, UP, YAW = range(4)

_LONGEST_TIMESTEP_S = 0.01
_DECAY_ERROR = 1e-3
_RADIANS_PER_STEP = 0.05


@dataclass(frozen=True, kw_only=True)
class PlantFactors:
    """How the plant differs from the object certified.

    Attributes:
        damping: factor on all of its damping.
        stiffness: factor on all of its elastic stiffness.
    """

    damping: float = 1.0
    stiffness: float = 1.0

    def __post_init__(self) -> None:
        settle(self, "damping", require_non_negative)
        settle(self, "stiffness", require_non_negative)


@dataclass(frozen=True, kw_only=True)
class InputLimits:
    """Largest inputs an attack may use, and where it may start.

    Attributes:
        forward_m_s2: |forward grasp acceleration|, errors included.
        left_m_s2: |leftward grasp acceleration|.
        up_m_s2: |vertical grasp acceleration|.
        yaw_rate_rad_s: |yaw rate|.
        start: |z2 − z2*| of every coordinate at the start.
        start_rate: |ż2| of every coordinate at the start.
    """

    forward_m_s2: float
    left_m_s2: float = 0.0
    up_m_s2: float = 0.0
    yaw_rate_rad_s: float = 0.0
    start: float = 0.0
    start_rate: float = 0.0

    def scaled(self, factor: float) -> InputLimits:
        """Return the limits with other horizontal accelerations, the ones that are certified."""
        return replace(
            self,
            forward_m_s2=factor * self.forward_m_s2,
            left_m_s2=factor * self.left_m_s2,
        )

    @property
    def inputs(self) -> Array:
        """Limits in the order of the rig's inputs, (4,)."""
        return np.array([self.forward_m_s2, self.left_m_s2, self.up_m_s2, self.yaw_rate_rad_s])


@dataclass(frozen=True, kw_only=True)
class Target:
    """An object to attack: the same one linearized and on its rig.

    Attributes:
        linear: linearization (16) in the rig's coordinates.
        rig: the rig with the object.
    """

    linear: LinearizedObject
    rig: RigModel

    def __post_init__(self) -> None:
        if self.linear.count != self.rig.count:
            raise ParameterError(
                "linear.count",
                self.linear.count,
                f"{self.rig.count}, the rig's number of coordinates",
                "Linearize the object that hangs on the rig.",
            )

    def varied(self, factors: PlantFactors) -> Target:
        """Return the target with other damping and stiffness."""
        return Target(
            linear=self.linear.scaled(damping=factors.damping, stiffness=factors.stiffness),
            rig=self.rig.varied(damping=factors.damping, stiffness=factors.stiffness),
        )

    @property
    def timestep_s(self) -> float:
        """Integration step of the rig."""
        return float(self.rig.model.opt.timestep)

    @property
    def slowest_speed_rad_s(self) -> float:
        """Smallest |λ| of a free motion."""
        return float(np.abs(np.linalg.eigvals(self.linear.A_u)).min())

    @property
    def slowest_decay_per_s(self) -> float:
        """Smallest decay rate of a free motion."""
        return float(-np.linalg.eigvals(self.linear.A_u).real.max())


def beam_target(beam: BeamParams, *, timestep_s: float | None = None) -> Target:
    """Return a beam as target; by default a time step that suits it is chosen."""
    linear = linearize(beam)
    return Target(
        linear=linear, rig=beam_rig(beam, timestep_s=timestep_s or suitable_timestep(linear))
    )


def mjcf_target(deformable: MjcfObject, *, timestep_s: float | None = None) -> Target:
    """Return an object from a model file as target."""
    linear = deformable.linear
    return Target(
        linear=linear, rig=deformable.rig(timestep_s=timestep_s or suitable_timestep(linear))
    )


def suitable_timestep(linear: LinearizedObject) -> float:
    """Return a step at which the rig is accurate for the slowest motion and stable for the others.

    The rig's integrator takes dampers at the end of a step and springs at its beginning: a mode
    with decay rate δ decays by the share δ h too slowly.
    """
    eigenvalues = np.linalg.eigvals(linear.A_u)
    decay = max(float(-eigenvalues.real.max()), 1e-9)
    slowest = float(np.abs(eigenvalues).min())
    timestep = min(_LONGEST_TIMESTEP_S, _DECAY_ERROR / decay, _RADIANS_PER_STEP / slowest)
    while np.abs(np.linalg.eigvals(_integration_map(linear, timestep))).max() > 1:
        timestep /= 2
    return timestep


def _integration_map(linear: LinearizedObject, timestep_s: float) -> Array:
    h, unit = timestep_s, np.eye(linear.count)
    implicit = linear.m_o22 + h * linear.d_o22
    from_position = -h * np.linalg.solve(implicit, linear.k_o22 + linear.gravity_stiffness)
    from_velocity = np.linalg.solve(implicit, linear.m_o22)
    return np.block([[unit + h * from_position, h * from_velocity], [from_position, from_velocity]])
