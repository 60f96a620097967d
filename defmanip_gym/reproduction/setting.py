"""Section VI in numbers: what the paper states, and what had to be chosen for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import DESIGN_DAMPING, PAPER_DISTURBANCE, BeamParams, DisturbanceParams
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.task_params import StartParams, TaskParams
from defmanip_gym.theory.certificates import certify
from defmanip_gym.theory.control.control_laws import ForceLoopGains

SIGMA_RAD = math.pi / 6
PLANT_DAMPING = 0.1

_FIELD_SHARE = 0.9
_OPENING_S = 20.0
_OUTER_PERIOD_S = 2.0


def paper_nu_max() -> float:
    """Return ν_max of Eq. (18) for the reference beam at the design damping, m/s²."""
    beam = BeamParams(damping=DESIGN_DAMPING)
    return certify(beam, sigma_rad=SIGMA_RAD, method="tanner").nu_max


@dataclass(frozen=True, kw_only=True)
class LoopStage:
    """A stretch of time with one sampling period and the gains that fit it.

    Attributes:
        period_s: of the force loop; an odd multiple of the physics period, which has a middle.
        gains: of the force loop.
        samples_per_update: force loop samples per sample of the outer loop.
        end_s: when the next stage begins.
    """

    period_s: float
    gains: ForceLoopGains
    samples_per_update: int
    end_s: float


@dataclass(frozen=True, kw_only=True)
class PaperSetting:
    """The slow transport.

    Attributes:
        nu_max: m/s².
        tracking_gain: ε, 1/s.
        approach_rate: of the velocity field near the goal, 1/s.
        force_law_damping: d̂ of the force law (10).
        stages: of the force loop.
        environment: plant, goal and disturbances; its control period is that of the last stage.
        arrival_m: the transport ends this close to the goal ...
        arrival_speed_m_s: ... and this slow,
        max_duration_s: or at this time.
    """

    nu_max: float
    tracking_gain: float
    approach_rate: float
    force_law_damping: float
    stages: tuple[LoopStage, ...]
    environment: TransportConfig
    start: tuple[float, ...] = field(default_factory=lambda: StartParams().center)
    arrival_m: float = 0.01
    arrival_speed_m_s: float = 1.5e-4
    max_duration_s: float

    @property
    def speed_bound(self) -> float:
        """sup‖ż1‖∞ = ν_max / 2, m/s."""
        return self.nu_max / 2

    @property
    def field_speed(self) -> float:
        """Speed of the velocity field, m/s: the bound, less room for what the noise adds."""
        return _FIELD_SHARE * self.speed_bound

    @property
    def expected_duration_s(self) -> float:
        """A guess for progress bars: the straight way at full speed, and the slow ends."""
        x, y = self.environment.task.goal[:2]
        way_m = math.hypot(self.start[0] - x, self.start[1] - y)
        return way_m / self.field_speed + 3.0 / self.approach_rate


def paper_setting(
    *,
    max_duration_s: float,
    control_period_s: float = 0.105,
    physics_period_s: float = 0.005,
    disturbance: DisturbanceParams = PAPER_DISTURBANCE,
) -> PaperSetting:
    """Return the setting of Section VI.

    ε is the paper's 1.089e-4 raised tenfold, which is ν_max in number. With z̈_1d = 0 the approach
    is z̈ + ε ż + ε k z = 0, and k = ε / 4 its critical damping.

    Raises:
        ParameterError: the physics period does not divide the control period.
    """
    nu_max = paper_nu_max()
    task = TaskParams(control_period_s=control_period_s, physics_period_s=physics_period_s)
    return PaperSetting(
        nu_max=nu_max,
        tracking_gain=nu_max,
        approach_rate=nu_max / 4,
        force_law_damping=0.0,
        stages=(_opening_stage(), _travel_stage(control_period_s)),
        environment=TransportConfig(
            constraint_mode="cost",
            sigma_rad=SIGMA_RAD,
            payload=RodPayload(beam=BeamParams(damping=PLANT_DAMPING)),
            task=task,
            disturbance=disturbance,
        ),
        max_duration_s=max_duration_s,
    )


def _opening_stage() -> LoopStage:
    """Return the stage in which the force loop meets the bias and the arm takes its reach.

    Until the integral cancels it, the bias speeds the grasp up by its acceleration over k2, and
    that fades at the rate ε only, over half an hour: hence the large k2 and the short period.
    """
    period_s = 0.015
    return LoopStage(
        period_s=period_s, gains=_gains(period_s), samples_per_update=1, end_s=_OPENING_S
    )


def _travel_stage(period_s: float) -> LoopStage:
    return LoopStage(
        period_s=period_s,
        gains=_gains(period_s),
        samples_per_update=max(1, round(_OUTER_PERIOD_S / period_s)),
        end_s=math.inf,
    )


def _gains(period_s: float) -> ForceLoopGains:
    """Return gains with which the force loop alone settles fastest for its k1.

    Its poles, the roots of z² − (1 − k1 − k2 T) z − k1, then are ±√k1.
    """
    k1 = 0.1
    return ForceLoopGains(k1=k1, k2=(1.0 - k1) / period_s)
