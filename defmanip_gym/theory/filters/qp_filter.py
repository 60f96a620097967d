"""``cbf_qp``: a control barrier function by quadratic program, what the literature would do.

The same barrier as ``storage``, but in continuous time: minimize |w − w*|² subject to ḣ ≥ −γ h with
h = level − B, the box of the largest acceleration, and the half space that touches the ball of the
speed limit where the grasp is heading; w* is what the speed limiter would leave of the wish.

It proves nothing for a robot that samples: neither what h does within a period, nor what the
limiter makes of a command that is beside the ball, nor what drive and arm can do is foreseen. Kept
as a reference to compare with.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from defmanip_gym.compiled import machine_code, without_garbage_collection
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.quadratic_program import daqp_solver
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.barrier_rows import half_spaces_all
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.safety_filter import FilterDecision, FilterProof
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.validation import require_number, require_params, settle

_TOLERANCE = 1e-9  # of the solver, and of what counts as allowed
_FARTHEST = 1e3  # times the largest acceleration: wishes beyond are cut before the solver sees them


@dataclass(frozen=True, kw_only=True)
class CbfQpParams:
    """What the program is made of.

    Attributes:
        gamma_per_s: γ of ḣ ≥ −γ h, the rate at which what is left to the level may be used up:
            towards 0 B may hardly rise, and from 1 / period on nothing brakes before the level.
        slack_weight: on the square of the slack, which is in shares of V_σ a second. It is there
            for states beyond the level, and for turns that raise B whatever is commanded.
    """

    gamma_per_s: float = 10.0
    slack_weight: float = 1e4

    def __post_init__(self) -> None:
        settle(self, "gamma_per_s", require_number, 1e-3, 1e3, "1/s")
        settle(self, "slack_weight", require_number, 1.0, 1e8)


class CbfQpFilter(StorageFilter):
    """Allows what is nearest to the wish under the barrier condition; a reference, not a proof.

    Args:
        beam: that is believed to be carried.
        sigma_rad: σ.
        robot: that carries it.
        task: its limits and control period.
        conditions: errors that the level makes room for, and the delay that is foreseen.
        intervals: factors on the beam's parameters; each end adds a barrier.
        params: γ and the weight of the slack.

    Attributes:
        pass_j: V_σ of the believed beam, J.
        level_share: up to which share of V_σ the storage may rise.

    Raises:
        CertificateError: there is no V_σ, or errors leave nothing of it.
        InstallationError: DAQP, which solves the programs, is not installed.
    """

    name = "cbf_qp"
    proof: FilterProof = "none"
    arguments = (*StorageFilter.arguments, "params")

    def __init__(
        self,
        beam: BeamParams = BeamParams(),
        *,
        sigma_rad: float = math.pi / 6,
        robot: RobotParams = RobotParams(),
        task: TaskParams = TaskParams(),
        conditions: FilterConditions = FilterConditions(),
        intervals: PayloadIntervals = PayloadIntervals(),
        params: CbfQpParams = CbfQpParams(),
    ) -> None:
        self.params = require_params("params", params, CbfQpParams)
        self._solve = daqp_solver(self.name)
        super().__init__(
            beam,
            sigma_rad=sigma_rad,
            robot=robot,
            task=task,
            conditions=conditions,
            intervals=intervals,
        )
        beams, self._largest = len(self.setup.levels), self.setup.limits.max_acceleration_m_s2
        # unknowns are w and the slack
        self._H = np.diag((1.0, 1.0, 1.0, self.params.slack_weight))
        self._low = np.full(beams + 5, -np.inf)
        self._low[:4] = (-self._largest,) * 3 + (0.0,)

    @without_garbage_collection()
    def _compile_decision(self) -> None:
        sensed, vectors, numbers, _ = self._examples()
        rows = len(self.setup.levels) + 1
        self._half_spaces = machine_code(
            half_spaces_all,
            self.setup,
            self.params.gamma_per_s,
            vectors,
            sensed,
            self._room,
            np.empty((1, rows, 3)),
            np.empty((1, rows)),
            vectors,
            numbers,
            numbers,
        )

    def _decide(
        self, wished: Array, sensed: Sensed, residual: Array, uncertainty: Array
    ) -> FilterDecision:
        count, rows = len(wished), len(self.setup.levels) + 1
        slopes, bounds = np.empty((count, rows, 3)), np.empty((count, rows))
        limited, excess, margin = np.empty_like(wished), np.empty(count), np.empty(count)
        self._half_spaces(
            self.setup,
            self.params.gamma_per_s,
            wished,
            sensed,
            self._room,
            slopes,
            bounds,
            limited,
            excess,
            margin,
        )
        allowed = wished.copy()
        for i in (excess > _TOLERANCE).nonzero()[0]:
            allowed[i] = self._nearest(limited[i], slopes[i], bounds[i])
        return FilterDecision(allowed, margin)

    def _nearest(self, wanted: Array, slopes: Array, bounds: Array) -> Array:
        """Return the w nearest to the wanted one within half spaces, (3,) m/s²."""
        farthest = _FARTHEST * self._largest
        linear = np.append(-np.clip(wanted, -farthest, farthest), 0.0)
        rows = np.column_stack((slopes, -np.ones(len(slopes))))
        rows[-1, 3] = 0.0  # no slack on the speed limit
        high = np.concatenate(((self._largest,) * 3, (np.inf,), bounds))
        found, _, flag, _ = self._solve(
            self._H, linear, rows, high, self._low, primal_tol=_TOLERANCE, dual_tol=_TOLERANCE
        )
        if flag < 1:  # by rounding only, as coasting satisfies all but the slack
            return np.zeros(3)
        nearest: Array = np.clip(found[:3], -self._largest, self._largest)
        return nearest
