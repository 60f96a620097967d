"""Objects from MuJoCo model files: their partition (6) and equilibrium (12), taken numerically.

The object hangs on the rig's carriage. Inverse dynamics there gives Q(z2, ż2, z̈1, u2), the internal
forces that motion needs beyond what springs and dampers give; M comes from MuJoCo's mass matrix and
everything else from central differences of Q (docs/derivations.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from defmanip_gym.errors import ObjectFileError
from defmanip_gym.objects.internal_forces import CARRIAGE, YAW, InternalForces
from defmanip_gym.objects.linkage_from import linkage_from
from defmanip_gym.params import LARGEST_SIGMA_RAD
from defmanip_gym.plant.object_file import ObjectFile, read_object_file
from defmanip_gym.plant.rig_model import RigModel
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.linkage import Linkage
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject

_FORWARD, _LEFT, _UP = range(3)
_STEP = 1e-5  # rad, m: truncation 1e-10, rounding 1e-11 of the forces
_NEWTON_STEPS = 50
_FORCE_TOLERANCE = 1e-10  # of the object's weight, N or N·m per m
# m̃_o11's smallest eigenvalue by the object's mass; a point mass on a hinge gives 0
_LEAST_APPARENT_INERTIA = 1e-6
_NEGLIGIBLE = 1e-8


def object_from_mjcf(path: str | Path, *, grasp_site: str) -> LinearizedObject:
    """Linearize the object in a model file about its static equilibrium.

    Args:
        path: MJCF file. Its one root body is held rigidly at the grasp site, in the orientation it
            has there: x forward, y left, z up. Joints of the root body itself stay free.
        grasp_site: name of a site on the root body.

    Raises:
        ObjectFileError: see ``read_object_file``; no equilibrium found; the grasp site moves with
            the joints; or an object without apparent inertia at the grasp.
    """
    return mjcf_object(path, grasp_site=grasp_site).linear


def mjcf_object(path: str | Path, *, grasp_site: str) -> MjcfObject:
    """Return the object in a model file, linearized and ready to be hung on a rig."""
    object_file = read_object_file(path, grasp_site=grasp_site)
    forces = InternalForces(object_file)
    equilibrium = _equilibrium(object_file, forces)
    linear = _linearized(object_file, forces, equilibrium)
    _require_apparent_inertia(object_file, linear)
    return MjcfObject(object_file=object_file, linear=linear)


@dataclass(frozen=True, kw_only=True)
class MjcfObject:
    """An object from a model file.

    Attributes:
        object_file: the file.
        linear: the object linearized about its equilibrium.
    """

    object_file: ObjectFile
    linear: LinearizedObject

    def linkage(self) -> Linkage:
        """Return the object as links, of which ``ObjectStorageFilter`` makes a filter.

        Raises:
            ObjectFileError: it has springs that links do not, such as tendons through sites.
        """
        return linkage_from(self.object_file)

    def rig(self, *, timestep_s: float = 0.002) -> RigModel:
        """Return the rig that holds the object; z2 are its joint positions."""
        return RigModel(
            model=self.object_file.rig_model(timestep_s=timestep_s, is_heavy=True),
            coordinates=self.linear.coordinates,
            read_out=np.eye(self.linear.count),
            equilibrium=self.linear.equilibrium,
        )


def _equilibrium(object_file: ObjectFile, forces: InternalForces) -> Array:
    """Return z2* of Eq. (12) by Newton's method from the file's own configuration."""
    z2 = forces.model.qpos0[CARRIAGE:].copy()
    tolerance = _FORCE_TOLERANCE * object_file.mass_kg * 10.0
    residual = forces(z2)
    for _ in range(_NEWTON_STEPS):
        stiffness = _slope(forces, z2)
        step, *_ = np.linalg.lstsq(stiffness, -residual, rcond=1e-12)
        largest = np.abs(step).max()
        z2 = z2 + step * min(1.0, 0.3 / largest if largest > 0 else 1.0)
        residual = forces(z2)
        # where the residual is small but steps are not, the stiffness is singular
        if np.abs(residual).max() < tolerance and largest < 1e-6:
            return _stable(object_file, forces, z2)
    raise ObjectFileError(
        "equilibrium",
        np.array2string(z2, precision=4),
        "a configuration in which springs balance gravity",
        f"Newton's method from the file's configuration left {np.abs(residual).max():.3g} N or "
        "N m; give the joints springs or let the object hang in the file.",
    )


def _stable(object_file: ObjectFile, forces: InternalForces, z2: Array) -> Array:
    stiffness = _slope(forces, z2)
    eigenvalues = np.linalg.eigvalsh((stiffness + stiffness.T) / 2)
    smallest = eigenvalues[0]
    if smallest <= _NEGLIGIBLE * np.abs(eigenvalues).max():
        raise ObjectFileError(
            "equilibrium",
            np.array2string(z2, precision=4),
            "a stable equilibrium: positive stiffness in all directions",
            f"The smallest stiffness is {smallest:.3g}; hang the object the other way up, give "
            "its joints springs, or tilt their axes out of the vertical.",
        )
    return np.where(np.abs(z2) < 1e-12, 0.0, z2)


def _linearized(
    object_file: ObjectFile, forces: InternalForces, equilibrium: Array
) -> LinearizedObject:
    motion = forces.grasp_motion(equilibrium)
    if np.abs(motion).max() > _NEGLIGIBLE:
        moving = np.flatnonzero(np.abs(motion).max(axis=0) > _NEGLIGIBLE)
        raise ObjectFileError(
            "grasp_site",
            object_file.grasp_site,
            "a site that the joints leave where it is",
            f"{object_file.coordinates[moving[0]]!r} moves it; put it on the joint's axis, or on "
            "a root body without that joint.",
        )
    if np.abs(equilibrium).max() >= LARGEST_SIGMA_RAD:
        raise ObjectFileError(
            "equilibrium",
            np.array2string(equilibrium, precision=4),
            f"coordinates within ±{LARGEST_SIGMA_RAD:.4g}",
            "Deformation is counted from the joints' zero; build the object as it hangs.",
        )

    def centrifugal(z2: Array) -> Array:
        return forces(z2) - forces(z2, yaw_rate_rad_s=1.0)

    mass = forces.mass_matrix(equilibrium)
    inner = slice(CARRIAGE, None)
    elastic = _slope(forces.elastic, equilibrium)
    return LinearizedObject(
        m_o11=mass[:3, :3].copy(),
        m_o12=mass[:3, inner].copy(),
        m_o22=mass[inner, inner].copy(),
        d_o22=_slope(lambda rate: forces(equilibrium, rate), np.zeros(forces.count)),
        k_o22=elastic,
        gravity_stiffness=_slope(forces, equilibrium) - elastic,
        horizontal_stiffness=np.stack(
            [_acceleration_stiffness(forces, equilibrium, axis) for axis in (_FORWARD, _LEFT)]
        ),
        vertical_stiffness=_acceleration_stiffness(forces, equilibrium, _UP),
        centrifugal_stiffness=_slope(centrifugal, equilibrium),
        equilibrium=equilibrium,
        is_excited_by_yaw=_is_excited_by_yaw(forces, equilibrium, mass),
        coordinates=object_file.coordinates,
    )


def _acceleration_stiffness(forces: InternalForces, z2: Array, axis: int) -> Array:
    """Return ∂Q/∂z2 per m/s² of grasp acceleration along an axis, (N, N)."""
    unit = np.eye(3)[axis]  # Q is linear in it, so any size is exact
    return _slope(lambda each: forces(each, acceleration_m_s2=unit) - forces(each), z2)


def _is_excited_by_yaw(forces: InternalForces, equilibrium: Array, mass: Array) -> bool:
    """Whether u2² pushes at z2*, u2 couples to ż2, or u̇2 to z̈2, there or beside z2*.

    u̇2 is not bounded by a certificate, so its torque must not grow with z2 either.
    """

    def coriolis(rate: Array) -> Array:
        return forces(equilibrium, rate, yaw_rate_rad_s=1.0)

    at_rest = forces(equilibrium, yaw_rate_rad_s=1.0) - forces(equilibrium)
    rest = np.zeros(forces.count)
    gyroscopic = _slope(coriolis, rest) - _slope(lambda rate: forces(equilibrium, rate), rest)
    yaw_coupling = _slope(lambda z2: forces.mass_matrix(z2)[YAW, CARRIAGE:], equilibrium)
    inertia = np.abs(mass[CARRIAGE:, CARRIAGE:]).max()
    couplings = (at_rest, gyroscopic, mass[YAW, CARRIAGE:], yaw_coupling)
    return max(float(np.abs(coupling).max()) for coupling in couplings) > 1e-6 * inertia


def _require_apparent_inertia(object_file: ObjectFile, linear: LinearizedObject) -> None:
    """Refuse a singular m̃_o11: Eq. (10) then determines no force."""
    try:
        np.linalg.cholesky(linear.m_o22)
        apparent = linear.m_o11 - linear.m_o12 @ np.linalg.solve(linear.m_o22, linear.m_o12.T)
        smallest = np.linalg.eigvalsh(apparent)[0] / object_file.mass_kg
    except np.linalg.LinAlgError:
        smallest = 0.0
    if smallest < _LEAST_APPARENT_INERTIA:
        raise ObjectFileError(
            "apparent inertia",
            float(smallest),
            f"m̃_o11 of Eq. (10) above {_LEAST_APPARENT_INERTIA:g} of the object's mass",
            "Point masses on strings have none: give bodies an extent, or the root a mass.",
        )


def _slope(function: Callable[[Array], Array], at: Array) -> Array:
    """Return the Jacobian of ``function`` by central differences, (N, N)."""
    columns = []
    for direction in _STEP * np.eye(len(at)):
        columns.append((function(at + direction) - function(at - direction)) / (2 * _STEP))
    return np.stack(columns, axis=1)
