"""The backup filter: accepts what a rollout of the nominal model shows to be safe."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg

from defmanip_gym.compiled import machine_code, without_garbage_collection
from defmanip_gym.errors import CertificateError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH
from defmanip_gym.theory.filters.backup import BackupRoom, BackupSetup
from defmanip_gym.theory.filters.backup_decision import decide_backup_all, show_all
from defmanip_gym.theory.filters.safety_filter import BoolArray, FilterDecision, FilterProof
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import StorageModel
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.theory.filters.storage_keeping import StorageMemory
from defmanip_gym.theory.payload.object_model import HangingBeam

_HORIZON = 100  # periods
_RATES = (12.0, 4.0)  # 1/s, of the backup laws
_HANDOVER = 0.04  # of V_σ: room for the tube where rollouts end
_LEAST_SHARE = 0.5  # of V_σ: where errors leave less, rollouts have to reckon with them alone
_FEWEST_SUBSTEPS, _MOST_SUBSTEPS = 2, 4
_STEP_RAD = 1.5  # of the fastest vibration that a substep should cover
_EDGE_ANGLES, _EDGE_RATES, _EDGE_REACH = 201, 401, 2.0  # of the picture of what is safe
_RESERVE = 0.01  # of σ: between substeps, and for what integrators differ in within a period


class BackupFilter(StorageFilter):
    """Keeps to what the nominal model, rolled out under a backup law, shows to stay within σ.

    It accepts whatever the storage filter accepts, and beyond that commands after which coasting
    or damping brings B below its level with ‖z2‖∞ ≤ σ all the way. Where V_σ is small beside what
    is safe, as for soft chains, that is much more. For the model that is rolled out there always is
    such a command; a tube on σ makes room for errors.

    Args:
        beam: that is believed to be carried, its damping included.
        sigma_rad: σ.
        robot: that carries it.
        task: its limits and control period.
        conditions: errors, noise and delay that it makes room for.
        intervals: factors on the beam's parameters; their ends are rolled out, too.

    Attributes:
        pass_j: V_σ of the believed beam, J.
        level_share: up to which share of V_σ the storage may rise before rollouts are asked.
        tube_rad: what is kept back of σ after p periods, (P + 1, N) rad.

    Raises:
        CertificateError: there is no V_σ, or errors leave nothing of σ.
    """

    name = "backup"
    proof: FilterProof = "nominal"

    def covers(self, carried: object) -> bool:
        """Whether it holds for this beam: the believed one within the intervals, damping too."""
        if not isinstance(carried, BeamParams):
            return False
        return self.intervals.cover_damping(self.beam, carried) and super().covers(carried)

    def inside(self, observation: Array, memory: StorageMemory) -> BoolArray:
        """Whether B is below its level or a backup law, from now on, is shown to be safe, (n,)."""
        sensed, uncertainty = self._estimated(observation, memory)
        margin = np.empty(len(sensed.swing))
        self._show_all(self.backup, sensed, memory.residual, uncertainty, self._backup_room, margin)
        within: BoolArray = margin >= 0.0
        return within

    def edge(self) -> tuple[Array, Array] | None:
        """Return the upper edge (φ, φ̇) of what is shown to be safe, one hinge only, else None.

        Of a grasp at rest, with the arm as at the goal; rates to within a two-hundredth.
        """
        level = super().edge()
        if level is None:
            return None
        swing = np.linspace(-self.sigma_rad, self.sigma_rad, _EDGE_ANGLES)
        rate = np.linspace(0.0, _EDGE_REACH * float(level[1].max()), _EDGE_RATES)
        sensed = Sensed.empty(swing.size * rate.size, 1)
        sensed.pitch[:] = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        sensed.swing[:, 0] = np.repeat(swing, rate.size)
        sensed.swing_rate[:, 0] = np.tile(rate, swing.size)
        count = len(sensed.swing)
        margin, nothing = np.empty(count), np.zeros((count, 3))
        no_noise = np.zeros((count, 1))
        self._show_all(self.backup, sensed, nothing, no_noise, self._backup_room, margin)
        # up to the first rate that is not safe
        safe = np.logical_and.accumulate(margin.reshape(swing.size, rate.size) >= 0.0, axis=1)
        kept = safe[:, 0]
        return swing[kept], rate[safe.sum(axis=1)[kept] - 1]

    def _decide(
        self, wished: Array, sensed: Sensed, residual: Array, uncertainty: Array
    ) -> FilterDecision:
        allowed, margin = np.empty_like(wished), np.empty(len(wished))
        self._decide_all(
            self.backup, wished, sensed, residual, uncertainty, self._backup_room, allowed, margin
        )
        return FilterDecision(allowed, margin)

    @without_garbage_collection()
    def _compile_decision(self) -> None:
        self.backup = self._backup_setup()
        self.tube_rad = self.backup.tube
        self._advancing = self.setup._replace(model=self.backup.rolled)
        self._backup_room = BackupRoom.empty(self.segment_count)
        sensed, vectors, numbers, uncertainty = self._examples()
        room = self._backup_room
        setup, examples = self.backup, (vectors, sensed, vectors, uncertainty)
        self._decide_all: Callable[..., None] = machine_code(
            decide_backup_all, setup, *examples, room, vectors, numbers
        )
        self._show_all = machine_code(
            show_all, self.backup, sensed, vectors, uncertainty, room, numbers
        )

    def _backup_setup(self) -> BackupSetup:
        corners = self.intervals.corners(self.beam)
        beams = tuple(
            replace(beam, damping=root, joint_damping=joint)
            for root, joint in self.intervals.dampings(self.beam)
            for beam in corners
        )
        period_s = self.task.control_period_s
        tubes = [_deviations(beam, period_s) for beam in beams]
        conditions = self.conditions
        error = conditions.forward_error_m_s2
        error += math.sin(self.sigma_rad) * conditions.vertical_error_m_s2
        tube = error * np.max([pushed for pushed, _, _ in tubes], axis=0)
        tube += _RESERVE * self.sigma_rad
        first = tube[1 + conditions.delay_periods].max()
        if not first < self.sigma_rad:
            raise CertificateError(
                "σ that errors and delay leave",
                float(self.sigma_rad - first),
                "more than 0 rad",
                "Allow a larger sigma_rad or smaller errors in conditions.",
            )
        fastest = max(rate for _, _, rate in tubes)
        substeps = math.ceil(fastest * period_s / _STEP_RAD)
        return BackupSetup(
            storage=self.setup,
            rolled=StorageModel.of(beams, self.sigma_rad, damped=True),
            sigma=self.sigma_rad,
            tube=tube,
            spread=np.max([spread for _, spread, _ in tubes], axis=0),
            rates=np.array(_RATES),
            substeps=min(max(substeps, _FEWEST_SUBSTEPS), _MOST_SUBSTEPS),
            delay=int(conditions.delay_periods),
        )

    def _level_shares(self) -> Array:
        shares: Array = np.maximum(1.0 - _HANDOVER - self._reserved_shares(), _LEAST_SHARE)
        return shares


def _deviations(beam: BeamParams, period_s: float) -> tuple[Array, Array, float]:
    """Return what errors become in the linear model, and its fastest vibration, rad/s.

    Returns:
        Angles after p periods with an acceleration of 1 m/s² in any direction in each,
        (P + 1, N) rad; those after p periods with all angles wrong by 1 rad, (P + 1, N); the rate.
    """
    model, count = HangingBeam(beam), beam.segment_count
    moments = model.chain.constants.first_moments
    inertia = model.chain.mass_matrix(np.full(count, -np.pi / 2))[2:, 2:]
    stiffness = model.k_o22 + GRAVITY_M_S2 * np.diag(moments)
    rows = np.hstack((stiffness, model.d_o22, moments[:, None]))
    rates = np.zeros((2 * count + 1, 2 * count + 1))
    rates[:count, count : 2 * count] = np.eye(count)
    rates[count : 2 * count] = -np.linalg.solve(inertia, rows)
    step = scipy.linalg.expm(period_s * rates)
    transition, response = step[:-1, :-1], step[:-1, -1]
    pushed, spread = np.zeros((_HORIZON + 1, count)), np.ones((_HORIZON + 1, count))
    free = np.eye(2 * count)
    for period in range(1, _HORIZON + 1):
        pushed[period] = pushed[period - 1] + np.abs(free[:count] @ response)
        free = transition @ free
        spread[period] = np.abs(free[:count, :count]).sum(axis=1)
    squares = scipy.linalg.eigvalsh(stiffness, inertia)
    return pushed, spread, float(np.sqrt(squares[-1]))
