"""Any object from a MuJoCo model file: hinges, slides, tendons and springs."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from defmanip_gym.errors import ObjectFileError, ParameterError
from defmanip_gym.objects.internal_forces import YAW, InternalForces
from defmanip_gym.objects.mjcf_object import MjcfObject, mjcf_object
from defmanip_gym.payloads.mjcf_cargo import MjcfCargo
from defmanip_gym.payloads.payload import Coordinate, Payload
from defmanip_gym.plant.held_object import HeldObject
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.theory.payload.linkage import HeldLinkage, Linkage
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class MjcfPayload(Payload):
    """An object from a file, held at a site of its root by a gripper that stays level.

    It is read once, and stays what it was then, whatever becomes of the file; two of them are the
    same if MuJoCo compiles the same from them and they are held at the same site.

    Attributes:
        path: MJCF file; see ``object_from_mjcf`` for what may be in it.
        grasp_site: name of a site on the root body.

    Raises:
        ParameterError: no path, or no name.
        ObjectFileError: the file is missing or invalid, holds no such object, or one that touches
            itself at rest or that something holds against gravity.
    """

    path: str
    grasp_site: str = "grasp"

    def __post_init__(self) -> None:
        for name, kinds in (("path", (str, os.PathLike)), ("grasp_site", (str,))):
            value = getattr(self, name)
            if not isinstance(value, kinds) or value == "":
                raise ParameterError(name, value, "a text", "As in path='hose.xml'.")
        path = Path(os.fspath(self.path)).expanduser().absolute()
        object.__setattr__(self, "path", str(path))
        _require_no_contact(self.thing)
        _require_weight(self.thing)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MjcfPayload) and self.identity == other.identity

    def __hash__(self) -> int:
        return hash((self.digest, self.grasp_site))

    @cached_property
    def thing(self) -> MjcfObject:
        """The object, linearized."""
        return mjcf_object(self.path, grasp_site=self.grasp_site)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of what MuJoCo made of the file, and of what that includes."""
        held = self.thing.object_file.held
        content = np.empty(mujoco.mj_sizeModel(held), dtype=np.uint8)
        mujoco.mj_saveModel(held, None, content)
        return hashlib.sha256(content.tobytes()).hexdigest()

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The file's joints in their order."""
        held, rest = self.thing.object_file.held, self.thing.linear.equilibrium
        slide = mujoco.mjtJoint.mjJNT_SLIDE
        units = ["m" if kind == slide else "rad" for kind in held.jnt_type]
        return tuple(
            Coordinate(name=name, unit=unit, rest=float(at))
            for name, unit, at in zip(self.linear.coordinates, units, rest, strict=True)
        )

    @property
    def identity(self) -> dict[str, Any]:
        """What the file compiled to, wherever it lies, and the site."""
        return {"payload": {"mjcf": self.digest, "grasp_site": self.grasp_site}}

    @property
    def known(self) -> dict[str, Any]:
        """What ``identity`` tells: a controller knows the file's object."""
        return self.identity

    @property
    def linear(self) -> LinearizedObject:
        """Of the file's object."""
        return self.thing.linear

    @property
    def mass_kg(self) -> float:
        """Of the whole object."""
        return self.thing.object_file.mass_kg

    @property
    def carried(self) -> tuple[HeldLinkage]:
        """The object as links, and its mass.

        Raises:
            ObjectFileError: it has springs that links do not.
        """
        return (HeldLinkage(self.linkage, self.mass_kg),)

    @cached_property
    def linkage(self) -> Linkage:
        """The object as links, of which filters are made; ObjectFileError as in ``carried``."""
        return self.thing.linkage()

    @property
    def extremes(self) -> tuple[MjcfPayload]:
        """It alone."""
        return (self,)

    @cached_property
    def yaw_inertia_kgm2(self) -> float:
        """About the vertical through the grasp, at rest."""
        matrix = InternalForces(self.thing.object_file).mass_matrix(self.linear.equilibrium)
        return float(matrix[YAW, YAW])

    @property
    def slowest_rad_s(self) -> float:
        """Of the linearized object."""
        return float(np.sqrt(self._modes[0][0]))

    @property
    def believed(self) -> None:
        """Nothing: its force is felt."""
        return None

    @property
    def is_hinged(self) -> bool:
        """It may hang in any way."""
        return False

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        """Squared frequencies, increasing, and shapes in columns, of small motions."""
        linear = self.thing.linear
        stiffness = linear.k_o22 + linear.gravity_stiffness
        squares, shapes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, linear.m_o22)
        return squares, shapes

    def body(self) -> HeldObject:
        """Return how MuJoCo holds it."""
        return HeldObject(self.thing.object_file)

    def cargo(self, simulation: Simulation, generators: Sequence[np.random.Generator]) -> MjcfCargo:
        """Return the objects of n episodes."""
        return MjcfCargo(self.thing, simulation.count)

    def swung(self, swing_rad: Array) -> Array:
        """Return objects out of the equilibrium along what accelerating forward bends first.

        The coordinate that is largest in it is as far out as the swing says.
        """
        linear = self.thing.linear
        _, shapes = self._modes
        pushed = np.abs(shapes.T @ linear.m_o12[0]) > 1e-9 * np.abs(linear.m_o12).max(initial=0.0)
        shape = shapes[:, int(np.argmax(pushed))]
        shape = shape / shape[np.argmax(np.abs(shape))]
        return linear.equilibrium + swing_rad[:, None] * shape


def _require_no_contact(thing: MjcfObject) -> None:
    """Refuse an object that touches itself at rest: contacts are off where it is carried."""
    model = thing.object_file.held
    data = mujoco.MjData(model)
    data.qpos[:] = thing.linear.equilibrium
    mujoco.mj_forward(model, data)
    for contact in data.contact:
        one, other = (int(model.body_weldid[model.geom_bodyid[geom]]) for geom in contact.geom)
        joined = _above(model, one) == other or _above(model, other) == one
        if contact.dist >= 0 or joined:  # neighbours overlap at their joint
            continue
        bodies = [model.body(body).name for body in (one, other)]
        raise ObjectFileError(
            "contacts at rest",
            " and ".join(repr(name) for name in bodies),
            "an object whose parts do not touch one another as it hangs",
            "Part them, or give geoms that are only drawn contype='0' conaffinity='0'.",
        )


def _above(model: mujoco.MjModel, body: int) -> int:
    """Return what a joint hangs a body from: the first of those that are rigidly one."""
    return int(model.body_weldid[model.body_parentid[body]])


def _require_weight(thing: MjcfObject) -> None:
    """Refuse what gravity does not pull as the sensor at the grasp says."""
    if thing.object_file.held.body_gravcomp.any():
        raise ObjectFileError(
            "gravcomp",
            thing.object_file.held.body_gravcomp.tolist(),
            "0 in all bodies of what is carried",
            "What holds a body up would not be felt at the grasp: remove it, or lower its mass.",
        )
