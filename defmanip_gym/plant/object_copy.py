"""A compiled object, built once more below a rig's carriage.

Only numbers as MuJoCo compiled them are taken over. What a file asks of the compiler (total mass,
inertia from geoms, damping ratios, defaults, units, frames) was done with the root held still, and
must not be done again on the rig, where it would come out differently.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PRIMITIVES = tuple(
    getattr(mujoco.mjtGeom, f"mjGEOM_{kind}").value
    for kind in ("SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX")
)

HELD_SITE = "object/held"  # where the gripper holds the object


def add_object(
    spec: mujoco.MjSpec,
    carriage: mujoco.MjsBody,
    model: mujoco.MjModel,
    *,
    grasp_site: str,
    grasp_m: Array,
) -> list[mujoco.MjsBody]:
    """Hang an object from a carriage, in the orientation that it has in its world.

    Args:
        spec: the rig.
        carriage: body whose frame has the grasp as its origin.
        model: the object, compiled alone with its root held still; its joints are scalar.
        grasp_site: name of the site at which it is held.
        grasp_m: where that site is in the object's world, (3,).

    Returns:
        The carriage, and the object's bodies in the model's order.
    """
    bodies = [carriage]
    for index in range(1, model.nbody):
        parent = model.body_parentid[index]
        body = bodies[parent].add_body(
            pos=model.body_pos[index] - (grasp_m if parent == 0 else 0.0),
            quat=model.body_quat[index],
            gravcomp=model.body_gravcomp[index],
        )
        body.explicitinertial = True
        body.mass, body.inertia = model.body_mass[index], model.body_inertia[index]
        body.ipos, body.iquat = model.body_ipos[index], model.body_iquat[index]
        bodies.append(body)
    _add_joints(bodies, model)
    sites = [_name("site", index) for index in range(model.nsite)]
    sites[model.site(grasp_site).id] = HELD_SITE
    for index in np.flatnonzero(model.site_bodyid).tolist():  # what the world marks is not carried
        bodies[model.site_bodyid[index]].add_site(
            name=sites[index], pos=model.site_pos[index], quat=model.site_quat[index]
        )
    _add_tendons(spec, bodies, model, sites)
    return bodies


def add_drawn_geoms(
    spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], model: mujoco.MjModel
) -> tuple[str, ...]:
    """Draw what an object's file draws, meshes as the boxes around them, and return the names.

    Args:
        spec: the model that the object has been added to.
        bodies: as ``add_object`` returns them.
        model: the object, compiled alone.
    """
    added = []
    for index in np.flatnonzero(model.geom_bodyid).tolist():
        name = _name("geom", index)
        if spec.geom(name) is None:
            kind, size, offset = model.geom_type[index], model.geom_size[index], np.zeros(3)
            if kind not in _PRIMITIVES:
                kind, size = mujoco.mjtGeom.mjGEOM_BOX, model.geom_aabb[index, 3:]
                offset = model.geom_aabb[index, :3]
            turned = np.empty(3)
            mujoco.mju_rotVecQuat(turned, offset, model.geom_quat[index])
            bodies[model.geom_bodyid[index]].add_geom(
                name=name,
                type=mujoco.mjtGeom(kind),
                size=size,
                pos=model.geom_pos[index] + turned,
                quat=model.geom_quat[index],
                rgba=model.geom_rgba[index],
                mass=0,
            )
        added.append(name)
    return tuple(added)


def _name(kind: str, index: int) -> str:
    return f"object/{kind} {index}"


def _add_joints(bodies: list[mujoco.MjsBody], model: mujoco.MjModel) -> None:
    for index in range(model.njnt):
        # scalar joints have as many positions and velocities as there are of them
        joint = bodies[model.jnt_bodyid[index]].add_joint(
            name=_name("joint", index),
            type=mujoco.mjtJoint(model.jnt_type[index]),
            pos=model.jnt_pos[index],
            axis=model.jnt_axis[index],
            ref=model.qpos0[index],
            springref=model.qpos_spring[index],
            armature=model.dof_armature[index],
        )
        joint.stiffness[0] = model.jnt_stiffness[index]
        joint.damping[0] = model.dof_damping[index]


def _add_tendons(
    spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], model: mujoco.MjModel, sites: list[str]
) -> None:
    wrap = mujoco.mjtWrap
    for index in range(model.ntendon):
        tendon = spec.add_tendon(
            springlength=model.tendon_lengthspring[index], armature=model.tendon_armature[index]
        )
        tendon.stiffness[0] = model.tendon_stiffness[index]
        tendon.damping[0] = model.tendon_damping[index]
        first = model.tendon_adr[index]
        for step in range(first, first + model.tendon_num[index]):
            kind, target = model.wrap_type[step], model.wrap_objid[step]
            parameter = float(model.wrap_prm[step])
            if kind == wrap.mjWRAP_JOINT:
                tendon.wrap_joint(_name("joint", target), parameter)
            elif kind == wrap.mjWRAP_PULLEY:
                tendon.wrap_pulley(parameter)
            elif kind == wrap.mjWRAP_SITE:
                tendon.wrap_site(sites[target])
            else:
                side = sites[int(parameter)] if parameter >= 0 else ""
                tendon.wrap_geom(_wrapped_geom(spec, bodies, model, target), side)


def _wrapped_geom(
    spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], model: mujoco.MjModel, index: int
) -> str:
    """Return the name of a geom that tendons wrap around, added where it is not there yet."""
    name = _name("geom", index)
    if spec.geom(name) is None:
        bodies[model.geom_bodyid[index]].add_geom(
            name=name,
            type=mujoco.mjtGeom(model.geom_type[index]),
            size=model.geom_size[index],
            pos=model.geom_pos[index],
            quat=model.geom_quat[index],
            mass=0,
        )
    return name
