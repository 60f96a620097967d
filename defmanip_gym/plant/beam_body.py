"""The beam in MuJoCo: bodies, hinges, springs and dampers, hanging from any parent body.

Pitches are positive upwards, so hinge axes point along −y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from defmanip_gym.params import BeamParams
from defmanip_gym.plant import names
from defmanip_gym.plant.scene import BEAM_COLOR, SMALLEST_DRAWN_RADIUS_M

Array = NDArray[np.float64]

_PITCH_AXIS = [0.0, -1.0, 0.0]


@dataclass(frozen=True, kw_only=True)
class Segment:
    """What MuJoCo is told about a segment, in its own frame; leading dimensions are beams.

    Attributes:
        mass_kg: (...,).
        inertia_kgm2: about the centre, (..., 3).
        center_m: centre of mass and of the drawn capsule, (..., 3).
        tip_m: where the next segment hangs, (..., 3).
        capsule_m: radius, half length and 0, (..., 3).
    """

    mass_kg: Array
    inertia_kgm2: Array
    center_m: Array
    tip_m: Array
    capsule_m: Array


def segment_of(mass_kg: ArrayLike, length_m: ArrayLike, radius_m: float) -> Segment:
    """Return the segments, uniform rods, of this mass (...,) and length (...,)."""
    mass, length = np.asarray(mass_kg, dtype=np.float64), np.asarray(length_m, dtype=np.float64)
    across = mass * (length * length) / 12
    along = mass * radius_m**2 / 2
    return Segment(
        mass_kg=mass,
        inertia_kgm2=_vectors(across, across, along),
        center_m=_vectors(0.0, 0.0, -length / 2),
        tip_m=_vectors(0.0, 0.0, -length),
        capsule_m=_vectors(max(radius_m, SMALLEST_DRAWN_RADIUS_M), length / 2, 0.0),
    )


def add_beam(
    spec: mujoco.MjSpec,
    parent: mujoco.MjsBody,
    beam: BeamParams,
    *,
    position_m: Sequence[float] | Array,
    pitch_joints: tuple[str, ...] = (),
) -> mujoco.MjsBody:
    """Hang a beam from ``parent`` and return its first segment.

    Args:
        spec: the model that ``parent`` belongs to.
        parent: body that holds the beam.
        beam: its parameters.
        position_m: where it hangs, in the parent's frame.
        pitch_joints: hinges that pitch the parent; the first segment's angle from the vertical, on
            which root damper and root spring act, is their sum and the first hinge's.
    """
    segment = segment_of(beam.segment_mass_kg, beam.segment_length_m, beam.radius_m)
    for index in range(beam.segment_count):
        body = parent.add_body(name=names.segment(index), pos=position_m)
        joint = add_pitch_hinge(body, names.segment_hinge(index))
        if index > 0:
            joint.stiffness[0] = beam.joint_stiffness
            joint.damping[0] = beam.joint_damping
        set_inertia(body, float(segment.mass_kg), segment.center_m, segment.inertia_kgm2)
        body.add_geom(
            name=names.segment_geom(index),
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            pos=segment.center_m,
            size=segment.capsule_m,
            rgba=BEAM_COLOR,
            mass=0,
        )
        parent, position_m = body, segment.tip_m
    _tie_root_to_vertical(spec, beam, pitch_joints)
    return spec.body(names.segment(0))


def add_pitch_hinge(body: mujoco.MjsBody, name: str, armature: float = 0.0) -> mujoco.MjsJoint:
    """Let a body pitch in the vertical plane of the heading."""
    return body.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=_PITCH_AXIS, armature=armature
    )


def set_inertia(
    body: mujoco.MjsBody,
    mass_kg: float,
    center_m: Sequence[float] | Array,
    diagonal_kgm2: Sequence[float] | Array,
) -> None:
    """Give a body its mass, centre of mass and inertia instead of deriving them from geoms."""
    body.explicitinertial = True
    body.mass = mass_kg
    body.ipos = center_m
    body.iquat = [1.0, 0, 0, 0]
    body.inertia = diagonal_kgm2


def _vectors(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    """Return (..., 3) from components that broadcast."""
    vectors = np.empty((*np.broadcast(x, y, z).shape, 3))
    vectors[..., 0], vectors[..., 1], vectors[..., 2] = x, y, z
    return vectors


def _tie_root_to_vertical(
    spec: mujoco.MjSpec, beam: BeamParams, pitch_joints: tuple[str, ...]
) -> None:
    """Damp and spring-load the first segment's swing from the vertical, a sum of pitches."""
    tendon = spec.add_tendon(name=names.ROOT_DAMPER)
    tendon.damping[0] = beam.damping
    tendon.stiffness[0] = beam.root_stiffness
    tendon.springlength = [0.0, 0.0]
    for joint in (*pitch_joints, names.segment_hinge(0)):
        tendon.wrap_joint(joint, 1.0)
