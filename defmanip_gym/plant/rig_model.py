"""The rig on which an object alone is shaken: a carriage at the grasp, the object attached to it.

The carriage slides along x, y, z and yaws about the vertical through the grasp. With the inertia
that an ``ObjectRig`` gives it the object's reaction is lost in the sixth digit and grasp
accelerations are inputs; with none its mass matrix is that of Eq. (6). Contacts and constraints
are off.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.plant import names
from defmanip_gym.plant.beam_body import add_beam, set_inertia

Array = NDArray[np.float64]

CARRIAGE = "carriage"
CARRIAGE_JOINTS = ("carriage_x", "carriage_y", "carriage_z", "carriage_yaw")
INPUTS = ("forward", "left", "up", "yaw")  # order of the rig's ctrl

# kg and kg m² for every kg of the object: its reaction on the grasp is 1e-8 of what moves the grasp
_HEAVY = 1e8
_NEARLY_NOTHING = 1e-9  # MuJoCo wants every moving body to have mass


@dataclass(frozen=True, kw_only=True)
class RigModel:
    """A compiled rig.

    Attributes:
        model: MuJoCo's model; the carriage's four degrees of freedom come first.
        coordinates: names of the internal coordinates z2.
        read_out: (N, N), z2 = read_out @ q with q the object's joint positions.
        equilibrium: z2*, (N,), where simulations start.
    """

    model: mujoco.MjModel
    coordinates: tuple[str, ...]
    read_out: Array
    equilibrium: Array

    @property
    def count(self) -> int:
        """Number N of internal coordinates."""
        return len(self.coordinates)

    def varied(self, *, damping: float, stiffness: float) -> RigModel:
        """Return the rig with all damping and elastic stiffness of the object multiplied.

        The equilibrium stays where it is, which is right for beams: they hang straight.
        """
        model = copy.copy(self.model)
        for field in ("dof_damping", "tendon_damping"):
            getattr(model, field)[:] *= damping
        for field in ("jnt_stiffness", "tendon_stiffness"):
            getattr(model, field)[:] *= stiffness
        return replace(self, model=model)


def beam_rig(beam: BeamParams, *, timestep_s: float = 0.002) -> RigModel:
    """Return the rig that holds a beam; z2 are its segments' angles from the vertical."""

    def attach(spec: mujoco.MjSpec, carriage: mujoco.MjsBody) -> None:
        add_beam(spec, carriage, beam, position_m=[0.0, 0.0, 0.0])

    count = beam.segment_count
    return RigModel(
        model=rig_model(
            attach, timestep_s=timestep_s, carriage_inertia=heavy_carriage(beam.mass_kg)
        ),
        coordinates=tuple(names.segment_hinge(index) for index in range(count)),
        read_out=np.tril(np.ones((count, count))),
        equilibrium=np.zeros(count),
    )


def heavy_carriage(object_mass_kg: float) -> float:
    """Return the carriage inertia against which an object's reaction does not count."""
    return _HEAVY * object_mass_kg


def rig_model(
    attach: Callable[[mujoco.MjSpec, mujoco.MjsBody], None],
    *,
    timestep_s: float,
    carriage_inertia: float = 0.0,
) -> mujoco.MjModel:
    """Compile a rig.

    Args:
        attach: hangs the object from the carriage, whose frame has the grasp as its origin.
        timestep_s: integration step.
        carriage_inertia: kg along each slide and kg m² about the vertical.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "object_rig"
    spec.compiler.degree = False
    spec.option.timestep = timestep_s
    spec.option.gravity = [0.0, 0.0, -GRAVITY_M_S2]
    # implicit in dampers, symplectic in springs: DISCRETE would add the damping ratio ω h / 2 to
    # every spring's vibration, more than a light object has
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    off = mujoco.mjtDisableBit
    spec.option.disableflags |= off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT
    carriage = spec.worldbody.add_body(name=CARRIAGE)
    set_inertia(carriage, _NEARLY_NOTHING, [0, 0, 0], [_NEARLY_NOTHING] * 3)
    _add_carriage_joints(carriage, carriage_inertia)
    site = carriage.add_site(name=names.GRASP_SITE)
    attach(spec, carriage)
    _add_inputs(spec, site, max(carriage_inertia, 1.0))
    return spec.compile()


def _add_carriage_joints(carriage: mujoco.MjsBody, inertia: float) -> None:
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1])
    for name, kind, axis in zip(CARRIAGE_JOINTS, (slide, slide, slide, hinge), axes, strict=True):
        # rotor inertia has no weight, so the carriage does not fall
        carriage.add_joint(name=name, type=kind, axis=axis, armature=inertia)


def _add_inputs(spec: mujoco.MjSpec, site: mujoco.MjsSite, inertia: float) -> None:
    """Let ctrl be the grasp's acceleration in the yawing frame, and the yaw acceleration."""
    for index, name in enumerate(INPUTS):
        gear = [0.0] * 6
        if name == "yaw":
            target, kind, gear[0] = CARRIAGE_JOINTS[3], mujoco.mjtTrn.mjTRN_JOINT, inertia
        else:
            target, kind, gear[index] = site.name, mujoco.mjtTrn.mjTRN_SITE, inertia
        spec.add_actuator(name=name, target=target, trntype=kind, gear=gear).set_to_motor()
