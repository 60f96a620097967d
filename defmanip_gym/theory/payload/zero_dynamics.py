"""Zero dynamics of Section III: equilibrium (12), linearization (16), its Lyapunov matrix."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import control
import numpy as np

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.validation import require_array, require_flag, require_items, settle

_SQUARE = (
    "m_o22",
    "d_o22",
    "k_o22",
    "gravity_stiffness",
    "vertical_stiffness",
    "centrifugal_stiffness",
)


@dataclass(frozen=True, kw_only=True)
class LinearizedObject:
    """Small motions of an object about its equilibrium z2*, in the grasp's yawing frame.

    m_o22 δz̈2 + d_o22 δż2 + (k_o22 + Γ_g + Σ a_i Γ_i − u2² Γ_ω) δz2 = −m_o12ᵀ z̈1, δz2 = z2 − z2*:
    Eq. (6b) to first order in δz2, at the acceleration (a_x, a_y, a_z) and yaw rate u2. There may
    be any number N of internal coordinates, hinges in rad or slides in m. Built by ``linearize``
    for beams and by ``objects.mjcf_object.object_from_mjcf`` for a model file.

    Attributes:
        m_o11: (3, 3) kg.
        m_o12: (3, N), forward, left, up.
        m_o22: (N, N).
        d_o22: (N, N).
        k_o22: (N, N), elastic part of the stiffness.
        gravity_stiffness: Γ_g, (N, N), stiffness that gravity adds.
        horizontal_stiffness: Γ_x and Γ_y, (2, N, N), stiffness per m/s² of forward and of leftward
            acceleration; zero for what hangs straight.
        vertical_stiffness: Γ_z, (N, N), stiffness per m/s² of upward acceleration.
        centrifugal_stiffness: Γ_ω, (N, N), stiffness lost per (rad/s)² of yaw rate.
        equilibrium: z2* of Eq. (12), (N,).
        is_excited_by_yaw: whether turning moves the object even at its equilibrium, or a yaw
            acceleration, which nothing bounds, does; then no certificate allows a yaw rate.
        coordinates: names of the internal coordinates.

    Raises:
        ParameterError: arrays of other shapes, or no object of positive mass.
    """

    m_o11: Array
    m_o12: Array
    m_o22: Array
    d_o22: Array
    k_o22: Array
    gravity_stiffness: Array
    horizontal_stiffness: Array
    vertical_stiffness: Array
    centrifugal_stiffness: Array
    equilibrium: Array
    is_excited_by_yaw: bool
    coordinates: tuple[str, ...]

    def __post_init__(self) -> None:
        n = np.size(self.equilibrium)
        for name, shape in (
            ("m_o11", (3, 3)),
            ("m_o12", (3, n)),
            ("horizontal_stiffness", (2, n, n)),
            ("equilibrium", (n,)),
            *((name, (n, n)) for name in _SQUARE),
        ):
            settle(self, name, require_array, shape)
        settle(self, "coordinates", require_items, str)
        settle(self, "is_excited_by_yaw", require_flag)
        if not np.linalg.eigvalsh(self.m_o22).min(initial=np.inf) > 0:
            raise ParameterError(
                "m_o22", self.m_o22.tolist(), "a positive definite matrix", "Give every part mass."
            )

    @property
    def count(self) -> int:
        """Number N of internal coordinates (the paper's n − m)."""
        return len(self.equilibrium)

    @cached_property
    def A_u(self) -> Array:
        """A_u of Eq. (16), (2N, 2N), for η = (z2 − z2*, ż2)."""
        zero, unit = np.zeros((self.count, self.count)), np.eye(self.count)
        stiffness = self.k_o22 + self.gravity_stiffness
        return np.block(
            [[zero, unit], [self.torque_input(-stiffness), self.torque_input(-self.d_o22)]]
        )

    @cached_property
    def B_u(self) -> Array:
        """B_u of Eq. (16), (2N, 9), for ν = (0, ż1, z̈1); only its last columns differ from 0."""
        B_u = np.zeros((2 * self.count, 9))
        B_u[self.count :, 6:] = self.torque_input(-self.m_o12.T)
        return B_u

    @property
    def forward_input(self) -> Array:
        """Column of B_u for the forward grasp acceleration, (2N,)."""
        return self.B_u[:, 6]

    def torque_input(self, torques: Array) -> Array:
        """Return m_o22⁻¹ times ``torques`` (N, k): what they do to z̈2."""
        return np.asarray(np.linalg.solve(self.m_o22, torques), dtype=np.float64)

    def scaled(self, *, damping: float = 1.0, stiffness: float = 1.0) -> LinearizedObject:
        """Return the object with all its damping and its elastic stiffness multiplied."""
        return replace(self, d_o22=damping * self.d_o22, k_o22=stiffness * self.k_o22)


def equilibrium(beam: BeamParams) -> Array:
    """Return z2* of Eq. (12), (N,) rad: the beam hangs straight down."""
    return np.zeros(beam.segment_count)


def linearize(beam: BeamParams) -> LinearizedObject:
    """Return the linearization (16) of a beam's zero dynamics about hanging at rest."""
    model = HangingBeam(beam)
    chain = model.chain.constants
    rest = np.zeros(model.count)
    partition = model.partition(rest, rest, np.zeros(()))
    moments = np.diag(chain.first_moments)
    return LinearizedObject(
        m_o11=partition.m_o11,
        m_o12=partition.m_o12,
        m_o22=partition.m_o22,
        d_o22=model.d_o22,
        k_o22=model.k_o22,
        gravity_stiffness=GRAVITY_M_S2 * moments,
        horizontal_stiffness=np.zeros((2, model.count, model.count)),
        vertical_stiffness=moments,
        centrifugal_stiffness=chain.second_moments + np.diag(chain.transverse - chain.axial),
        equilibrium=equilibrium(beam),
        is_excited_by_yaw=False,
        coordinates=tuple(f"segment {index + 1}" for index in range(model.count)),
    )


def is_hurwitz(A: Array) -> bool:
    """Whether all eigenvalues of A lie in the open left half plane (Lemma III.2)."""
    return bool(np.linalg.eigvals(A).real.max() < 0)


def lyapunov_matrix(A: Array) -> Array:
    """Return P with P A + Aᵀ P = −I (below Lemma III.2), same shape as the Hurwitz A."""
    return np.asarray(control.lyap(A.T, np.eye(A.shape[0])))
