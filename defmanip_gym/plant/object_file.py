"""An object from a MuJoCo model file: read, checked, and hung on the rig.

The rig's carriage takes the place of the gripper: it holds the root body, at the grasp site, with
the orientation that the file gives it. Forward, left and up are the file's x, y and z axes. What
the object is, is what MuJoCo compiles from the file with the root held still.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ObjectFileError
from defmanip_gym.params import GRAVITY_M_S2, LARGEST_SIGMA_RAD
from defmanip_gym.plant.object_copy import add_object
from defmanip_gym.plant.object_likeness import differences
from defmanip_gym.plant.rig_model import heavy_carriage, rig_model

Array = NDArray[np.float64]
_Made = TypeVar("_Made")
_SCALAR_JOINTS = (mujoco.mjtJoint.mjJNT_HINGE.value, mujoco.mjtJoint.mjJNT_SLIDE.value)


@dataclass(frozen=True, kw_only=True, eq=False)
class ObjectFile:
    """A checked model file.

    Attributes:
        path: of the file.
        grasp_site: name of the site at which it is held.
        coordinates: names of its joints, in MuJoCo's order.
        held: the object compiled alone, its root held still where the file has it.
        grasp_m: where the grasp site is in that model's world, (3,).
    """

    path: Path
    grasp_site: str
    coordinates: tuple[str, ...]
    held: mujoco.MjModel
    grasp_m: Array

    @property
    def mass_kg(self) -> float:
        """Mass of the whole object."""
        return float(self.held.body_mass.sum())

    def rig_model(self, *, timestep_s: float = 0.002, is_heavy: bool) -> mujoco.MjModel:
        """Compile the rig with the object, on a heavy carriage or on one of no inertia."""

        def attach(rig: mujoco.MjSpec, carriage: mujoco.MjsBody) -> None:
            add_object(rig, carriage, self.held, grasp_site=self.grasp_site, grasp_m=self.grasp_m)

        return _compiled(
            self.path,
            lambda: rig_model(
                attach,
                timestep_s=timestep_s,
                carriage_inertia=heavy_carriage(self.mass_kg) if is_heavy else 0.0,
            ),
        )


def read_object_file(path: str | Path, *, grasp_site: str) -> ObjectFile:
    """Read and check a model file.

    Raises:
        ObjectFileError: the file is missing or invalid, has no such site, or is no object of
            Eq. (6) with smooth internal dynamics.
    """
    path = Path(path)
    model = _held(path, grasp_site)
    _refuse_what_is_not_smooth(path, model)
    joints = _internal_joints(path, model)
    _refuse_narrow_limits(model, joints)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    object_file = ObjectFile(
        path=path,
        grasp_site=grasp_site,
        coordinates=joints,
        held=model,
        grasp_m=data.site(grasp_site).xpos.copy(),
    )
    _require_likeness(object_file)
    return object_file


def _held(path: Path, grasp_site: str) -> mujoco.MjModel:
    """Return the object without its free joint."""
    if not path.is_file():
        raise ObjectFileError("path", str(path), "an MJCF file", "Check the path.")
    spec = _compiled(path, lambda: mujoco.MjSpec.from_file(str(path)))
    root = _root(path, spec)
    _refuse_other_sites(path, spec, root, grasp_site)
    for joint in list(root.joints):
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            spec.delete(joint)
    for key in list(spec.keys):  # they count the free joint's coordinates
        spec.delete(key)
    spec.compiler.fusestatic = False  # a root without its free joint would be lost in the world
    spec.option.enableflags = 0  # nothing sleeps
    return _compiled(path, spec.compile)


def _require_likeness(object_file: ObjectFile) -> None:
    """Refuse an object that moves differently on the rig than in its own file."""
    rig = object_file.rig_model(is_heavy=False)
    found = differences(object_file.held, object_file.grasp_m, rig)
    if found:
        raise ObjectFileError(
            "object",
            str(object_file.path),
            "an object made of bodies, joints, springs, dampers and tendons",
            f"On the rig it has another {' and another '.join(found)} than in the file with its "
            "root held still; remove what else acts on it there.",
        )


def _compiled(path: Path, make: Callable[[], _Made]) -> _Made:
    """Return what MuJoCo makes of a file, its complaints as our error."""
    try:
        return make()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise ObjectFileError(
            "path", str(path), "a model that MuJoCo compiles", f"MuJoCo says: {error}"
        ) from None


def _root(path: Path, spec: mujoco.MjSpec) -> mujoco.MjsBody:
    roots = list(spec.worldbody.bodies)
    if len(roots) != 1:
        raise ObjectFileError(
            "root bodies",
            [body.name for body in roots],
            f"exactly one body below the world of {path}",
            "Put the object below one body; everything in the file belongs to it.",
        )
    return roots[0]


def _refuse_other_sites(
    path: Path, spec: mujoco.MjSpec, root: mujoco.MjsBody, grasp_site: str
) -> None:
    if spec.site(grasp_site) is None:
        there = ", ".join(repr(site.name) for site in spec.sites if site.name) or "none"
        raise ObjectFileError(
            "grasp_site", grasp_site, f"a named site of {path}: {there}", "Name one of these."
        )
    if grasp_site not in [site.name for site in root.sites]:
        raise ObjectFileError(
            "grasp_site",
            grasp_site,
            f"a site of the root body {root.name!r}",
            "The gripper holds the root: move the site, or make its body the root.",
        )


def _internal_joints(path: Path, model: mujoco.MjModel) -> tuple[str, ...]:
    names = []
    for index in range(model.njnt):
        joint = model.joint(index)
        name = joint.name or f"joint {index + 1}"
        if joint.type[0] not in _SCALAR_JOINTS:
            raise ObjectFileError(
                "joint",
                name,
                "hinge and slide joints, and a free joint on the root",
                "Replace a ball joint by hinges with the same axes.",
            )
        names.append(name)
    if not names:
        raise ObjectFileError(
            "joints",
            0,
            "one hinge or slide joint or more",
            f"A rigid object does not deform; give the object in {path} joints.",
        )
    return tuple(names)


def _refuse_what_is_not_smooth(path: Path, model: mujoco.MjModel) -> None:
    """Refuse whatever (6) with constant M, D, K cannot stand for."""
    disabled = mujoco.mjtDisableBit
    passive = disabled.mjDSBL_SPRING | disabled.mjDSBL_DAMPER | disabled.mjDSBL_GRAVITY
    slack = model.tendon_lengthspring[:, 1] > model.tendon_lengthspring[:, 0]
    gravity = np.abs(model.opt.gravity - [0, 0, -GRAVITY_M_S2]).max()
    objections = {
        "friction loss": model.dof_frictionloss.any() or model.tendon_frictionloss.any(),
        "equality constraints": model.neq > 0,
        "actuators": model.nu > 0,
        "plugins": model.nplugin > 0,
        "flexible meshes (flex)": model.nflex > 0,
        "springs that yield": model.nplastic > 0,
        "mocap bodies": model.nmocap > 0,
        "tendon limits": model.tendon_limited.any(),
        "tendons that hold on to the world": _tie_to_the_world(model),
        "tendons with slack (a springlength range)": slack.any(),
        "nonlinear springs or dampers": any(
            getattr(model, name).any()
            for name in (
                "jnt_stiffnesspoly",
                "dof_dampingpoly",
                "tendon_stiffnesspoly",
                "tendon_dampingpoly",
            )
        ),
        "joints whose actuators compensate gravity": model.jnt_actgravcomp.any(),
        "a fluid (density or viscosity)": model.opt.density > 0 or model.opt.viscosity > 0,
        "disabled gravity, springs or dampers": model.opt.disableflags & passive,
        f"a gravity other than 0 0 -{GRAVITY_M_S2}": gravity > 1e-6,
    }
    found = [name for name, is_there in objections.items() if is_there]
    if found:
        raise ObjectFileError(
            "object",
            str(path),
            "a passive object with smooth dynamics",
            f"It has {', '.join(found)}; remove that.",
        )


def _tie_to_the_world(model: mujoco.MjModel) -> bool:
    """Whether a tendon passes a site or geom that the gripper would leave behind."""
    wrap = mujoco.mjtWrap
    bodies = {
        wrap.mjWRAP_SITE.value: model.site_bodyid,
        wrap.mjWRAP_SPHERE.value: model.geom_bodyid,
        wrap.mjWRAP_CYLINDER.value: model.geom_bodyid,
    }
    return any(
        kind in bodies and bodies[kind][target] == 0
        for kind, target in zip(model.wrap_type.tolist(), model.wrap_objid, strict=True)
    )


def _refuse_narrow_limits(model: mujoco.MjModel, joints: tuple[str, ...]) -> None:
    """Refuse joint limits that a certified motion could reach: the rig has no stops."""
    room = LARGEST_SIGMA_RAD
    # a stop begins to push at its margin
    inner = model.jnt_range + model.jnt_margin[:, None] * [1, -1]
    for name, is_limited, (low, high) in zip(joints, model.jnt_limited, inner, strict=True):
        if is_limited and not (low <= -room and room <= high):
            raise ObjectFileError(
                "range",
                f"{name}: [{low:.4g}, {high:.4g}]",
                f"no limits within ±{room:.4g} (rad or m)",
                "Widen the range or set limited='false'; σ is what keeps the joint inside.",
            )
