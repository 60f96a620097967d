"""Objects of rigid links on hinges and slides, hanging from the grasp: where their links are.

The general case of what ``object_model`` has formulas for: joints about any axes, several on one
body, branches, springs between any joints. Axes are those of the yawing base frame (forward, left,
up), the origin is the grasp. Recursions over links, compiled, one state at a time.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable
from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import number_array


class Linkage(NamedTuple):
    """N links, each on one joint; parents come first (compiled code takes named tuples).

    A link's frame has its origin on the joint's axis. Massless links make joints with several
    degrees of freedom.

    Attributes:
        parent: index of the link that it hangs on, (N,); -1 for the gripper.
        slides: 1 for slides, 0 for hinges, (N,).
        rotation: orientation in the parent's frame where the joint is at rest, (N, 3, 3).
        offset: origin there, (N, 3) m.
        axis: of the joint, in the link's own frame, (N, 3), unit vectors.
        rest: coordinate at which the joint is at rest, (N,) rad or m.
        mass: (N,) kg.
        center: of mass, in the link's frame, (N, 3) m.
        inertia: about it, in the axes of the link, (N, 3, 3) kg·m².
        armature: inertia that a joint's motion alone has, (N,) kg·m² or kg.
        stiffness: K of the elastic energy ½ z2ᵀ K z2 − kᵀ z2, (N, N).
        preload: k, (N,).
    """

    parent: NDArray[np.int64]
    slides: NDArray[np.int64]
    rotation: Array
    offset: Array
    axis: Array
    rest: Array
    mass: Array
    center: Array
    inertia: Array
    armature: Array
    stiffness: Array
    preload: Array


class HeldLinkage(NamedTuple):
    """Links, and what they weigh with what the gripper holds, kg."""

    linkage: Linkage
    mass_kg: float


def require_linkage(name: str, value: Any) -> Linkage:
    """Return a linkage, or that of a mapping of its fields.

    Raises:
        ParameterError: neither; arrays of other shapes; a link before its parent.
    """
    fields = value._asdict() if isinstance(value, Linkage) else value
    if not isinstance(fields, dict) or set(fields) != set(Linkage._fields):
        remedy = "Take that of an MjcfObject: mjcf_object(...).linkage()."
        raise ParameterError(name, value, "a Linkage, or a mapping of its fields", remedy)
    n = np.size(fields["parent"])
    shapes = {"rotation": (n, 3, 3), "inertia": (n, 3, 3), "stiffness": (n, n)}
    shapes |= {each: (n, 3) for each in ("offset", "axis", "center")}
    arrays = {}
    for field, given in fields.items():
        array, shape = number_array(given), shapes.get(field, (n,))
        if array is None or array.shape != shape or not np.isfinite(array).all() or n == 0:
            raise ParameterError(
                f"{name}.{field}", given, f"finite numbers {shape}", "See Linkage."
            )
        arrays[field] = np.array(array, dtype=np.float64)
    parents, slides = arrays.pop("parent").astype(np.int64), arrays.pop("slides").astype(np.int64)
    if (parents >= np.arange(n)).any() or (parents < -1).any():
        raise ParameterError(f"{name}.parent", parents, "links after their parents", "Sort them.")
    return Linkage(parent=parents, slides=slides, **arrays)


class LinkageRoom(NamedTuple):
    """Where the links of one state are.

    Attributes:
        turned: orientations, (N, 3, 3).
        origin: of the links' frames, (N, 3) m.
        axis: of the joints, (N, 3).
        center: of mass, (N, 3) m.
        inertia: about it, (N, 3, 3) kg·m².
    """

    turned: Array
    origin: Array
    axis: Array
    center: Array
    inertia: Array

    @classmethod
    def empty(cls, count: int) -> LinkageRoom:
        """Return room for N links."""
        square, vectors = (count, 3, 3), (count, 3)
        return cls(*(np.zeros(each) for each in (square, vectors, vectors, vectors, square)))


@compilable
def cross(a: Array, b: Array, k: int) -> float:
    """Return component k of a × b."""
    i, j = (k + 1) % 3, (k + 2) % 3
    return a[i] * b[j] - a[j] * b[i]


@compilable
def place(linkage: Linkage, z2: Array, room: LinkageRoom) -> None:
    """Write where the links are at coordinates (N,), rad or m."""
    for i in range(len(linkage.mass)):
        _place_frame(linkage, i, z2[i] - linkage.rest[i], room)
        turned = room.turned[i]
        for k in range(3):
            moved = room.origin[i, k]
            for m in range(3):
                moved += turned[k, m] * linkage.center[i, m]
            room.center[i, k] = moved
            for m in range(3):
                value = 0.0
                for p in range(3):
                    for q in range(3):
                        value += turned[k, p] * linkage.inertia[i, p, q] * turned[m, q]
                room.inertia[i, k, m] = value


@compilable
def _place_frame(linkage: Linkage, i: int, moved: float, room: LinkageRoom) -> None:
    """Write orientation, axis and origin of link i, whose joint has moved by rad or m."""
    parent, turned, axis = linkage.parent[i], room.turned[i], room.axis[i]
    for k in range(3):
        room.origin[i, k] = 0.0 if parent < 0 else room.origin[parent, k]
        for m in range(3):
            if parent < 0:
                turned[k, m] = linkage.rotation[i, k, m]
                continue
            turned[k, m] = 0.0
            for p in range(3):
                turned[k, m] += room.turned[parent, k, p] * linkage.rotation[i, p, m]
        for m in range(3):
            along = 1.0 if m == k else 0.0
            if parent >= 0:
                along = room.turned[parent, k, m]
            room.origin[i, k] += along * linkage.offset[i, m]
    for k in range(3):
        axis[k] = 0.0
        for m in range(3):
            axis[k] += turned[k, m] * linkage.axis[i, m]
    if linkage.slides[i] != 0:
        for k in range(3):
            room.origin[i, k] += axis[k] * moved
        return
    cosine, sine = cos(moved), sin(moved)
    for m in range(3):  # Rodrigues' formula, column by column
        x, y, z = turned[0, m], turned[1, m], turned[2, m]
        along = (axis[0] * x + axis[1] * y + axis[2] * z) * (1.0 - cosine)
        turned[0, m] = cosine * x + sine * (axis[1] * z - axis[2] * y) + along * axis[0]
        turned[1, m] = cosine * y + sine * (axis[2] * x - axis[0] * z) + along * axis[1]
        turned[2, m] = cosine * z + sine * (axis[0] * y - axis[1] * x) + along * axis[2]
