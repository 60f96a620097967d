"""The links of an object from a model file: MuJoCo's compiled numbers for the theory's formulas."""

from __future__ import annotations

import mujoco
import numpy as np

from defmanip_gym.errors import ObjectFileError
from defmanip_gym.objects.internal_forces import CARRIAGE, YAW, InternalForces
from defmanip_gym.plant.object_file import ObjectFile
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.linkage_bounds import look
from defmanip_gym.theory.filters.linkage_storage import LinkageModel
from defmanip_gym.theory.payload.linkage import Linkage

_STATES, _DEFLECTION, _TOLERANCE = 8, 0.5, 1e-8


def linkage_from(object_file: ObjectFile) -> Linkage:
    """Return the links of an object, held at its grasp site.

    Raises:
        ObjectFileError: it has springs that links do not, such as tendons through sites.
    """
    forces = InternalForces(object_file)
    linkage = _links(forces.model)
    _require_likeness(object_file, forces, linkage)
    return linkage


def _links(model: mujoco.MjModel) -> Linkage:
    """Return a link for each joint; bodies without joints are part of what they are fixed to."""
    count = model.nv - CARRIAGE
    linkage = Linkage(
        parent=np.full(count, -1),
        slides=np.zeros(count, dtype=np.int64),
        rotation=np.tile(np.eye(3), (count, 1, 1)),
        offset=np.zeros((count, 3)),
        axis=model.jnt_axis[CARRIAGE:].copy(),
        rest=model.qpos0[CARRIAGE:].copy(),
        mass=np.zeros(count),
        center=np.zeros((count, 3)),
        inertia=np.zeros((count, 3, 3)),
        armature=model.dof_armature[CARRIAGE:].copy(),
        stiffness=np.diag(model.jnt_stiffness[CARRIAGE:]),
        preload=model.jnt_stiffness[CARRIAGE:] * model.qpos_spring[CARRIAGE:],
    )
    # of each body: the link that it belongs to, and its place in that link's frame
    link, turned, placed = {0: -1, 1: -1}, {1: np.eye(3)}, {1: np.zeros(3)}
    for body in range(2, model.nbody):
        parent = int(model.body_parentid[body])
        link[body] = link[parent]
        turned[body] = turned[parent] @ _matrix(model.body_quat[body])
        placed[body] = placed[parent] + turned[parent] @ model.body_pos[body]
        first = int(model.body_jntadr[body])
        for joint in range(first, first + int(model.body_jntnum[body])):
            i = joint - CARRIAGE
            linkage.parent[i], slides = link[body], _slides(model, joint)
            linkage.slides[i] = slides
            anchor = np.zeros(3) if slides else model.jnt_pos[joint]
            linkage.rotation[i] = turned[body]
            linkage.offset[i] = placed[body] + turned[body] @ anchor
            link[body], turned[body], placed[body] = i, np.eye(3), -anchor
        if link[body] >= 0:
            _attach(model, body, linkage, link[body], turned[body], placed[body])
    _add_tendons(model, linkage)
    return linkage


def _attach(
    model: mujoco.MjModel, body: int, linkage: Linkage, i: int, turned: Array, placed: Array
) -> None:
    """Add a body's mass to link i."""
    mass = float(model.body_mass[body])
    if mass == 0.0:
        return
    own = turned @ _matrix(model.body_iquat[body])
    center = placed + turned @ model.body_ipos[body]
    total = linkage.mass[i] + mass
    between = center - linkage.center[i]
    reduced = linkage.mass[i] * mass / total
    linkage.inertia[i] += own @ np.diag(model.body_inertia[body]) @ own.T
    linkage.inertia[i] += reduced * (between @ between * np.eye(3) - np.outer(between, between))
    linkage.center[i] += mass / total * between
    linkage.mass[i] = total


def _add_tendons(model: mujoco.MjModel, linkage: Linkage) -> None:
    """Add the springs of tendons that are sums of joints."""
    for tendon in range(model.ntendon):
        first, number = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        arms = np.zeros(len(linkage.mass))
        for wrap in range(first, first + number):
            if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT:
                arms[model.wrap_objid[wrap] - CARRIAGE] += model.wrap_prm[wrap]
        stiffness = float(model.tendon_stiffness[tendon])
        linkage.stiffness[:] += stiffness * np.outer(arms, arms)
        linkage.preload[:] += stiffness * float(model.tendon_lengthspring[tendon, 0]) * arms


def _slides(model: mujoco.MjModel, joint: int) -> bool:
    return bool(model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE)


def _matrix(quaternion: Array) -> Array:
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quaternion, dtype=np.float64))
    return flat.reshape(3, 3)


def _require_likeness(object_file: ObjectFile, forces: InternalForces, linkage: Linkage) -> None:
    """Refuse an object that the links do not move and pull as MuJoCo does."""
    rng, nothing = np.random.default_rng(0), np.zeros(1)
    z2 = linkage.rest + _DEFLECTION * rng.uniform(-1, 1, (_STATES, forces.count))
    model = LinkageModel(linkage, nothing, nothing, nothing, np.ones(1), nothing, nothing)
    seen, inner = look(model, z2), slice(CARRIAGE, None)
    rows = [0, 1, 2, YAW]
    for i, configuration in enumerate(z2):
        matrix = forces.mass_matrix(configuration)
        for name, found, expected in (
            ("inertia", seen.matrix[i], matrix[inner, inner]),
            ("coupling to the grasp", seen.coupling[i], matrix[rows, inner]),
            ("force at rest", seen.slope[i], forces(configuration)),
        ):
            largest = float(np.abs(expected).max(initial=0.0))
            if float(np.abs(found - expected).max()) > _TOLERANCE * (largest + _TOLERANCE):
                raise ObjectFileError(
                    "object",
                    str(object_file.path),
                    "bodies on hinges and slides, springs in joints and in tendons over joints",
                    f"As such it has another {name}: replace what else acts in it, such as tendons "
                    "through sites, or body gravcomp.",
                )
