"""The beam in MuJoCo: bodies, hinges, springs and dampers, hanging from any parent body.

Pitches are positive upwards, so hinge axes point along −y.
"""

from __future__ import annotations

import mujoco

from defmanip_gym.params import BeamParams
from defmanip_gym.plant import names
from defmanip_gym.plant.scene import BEAM_COLOR, SMALLEST_DRAWN_RADIUS_M

_PITCH_AXIS = [0.0, -1.0, 0.0]


def add_beam(
    spec: mujoco.MjSpec,
    parent: mujoco.MjsBody,
    beam: BeamParams,
    *,
    position_m: list[float],
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
    length, mass = beam.segment_length_m, beam.segment_mass_kg
    across = mass * length**2 / 12
    along = mass * beam.radius_m**2 / 2
    for index in range(beam.segment_count):
        body = parent.add_body(name=names.segment(index), pos=position_m)
        joint = add_pitch_hinge(body, names.segment_hinge(index))
        if index > 0:
            joint.stiffness[0] = beam.joint_stiffness
            joint.damping[0] = beam.joint_damping
        set_inertia(body, mass, [0, 0, -length / 2], [across, across, along])
        body.add_geom(
            name=names.segment_geom(index),
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0, 0, 0, 0, 0, -length],
            size=[max(beam.radius_m, SMALLEST_DRAWN_RADIUS_M), 0, 0],
            rgba=BEAM_COLOR,
            mass=0,
        )
        parent, position_m = body, [0.0, 0.0, -length]
    _tie_root_to_vertical(spec, beam, pitch_joints)
    return spec.body(names.segment(0))


def add_pitch_hinge(body: mujoco.MjsBody, name: str, armature: float = 0.0) -> mujoco.MjsJoint:
    """Let a body pitch in the vertical plane of the heading."""
    return body.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=_PITCH_AXIS, armature=armature
    )


def set_inertia(
    body: mujoco.MjsBody, mass_kg: float, center_m: list[float], diagonal_kgm2: list[float]
) -> None:
    """Give a body its mass, centre of mass and inertia instead of deriving them from geoms."""
    body.explicitinertial = True
    body.mass = mass_kg
    body.ipos = center_m
    body.iquat = [1.0, 0, 0, 0]
    body.inertia = diagonal_kgm2


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
