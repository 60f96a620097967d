"""Design choices of ``mpc``."""

from __future__ import annotations

from dataclasses import dataclass, field

from defmanip_gym.baselines.analytic.law_params import WayLawParams
from defmanip_gym.baselines.analytic.way_params import WayParams
from defmanip_gym.theory.control.horizon import HorizonWeights
from defmanip_gym.theory.control.prediction import HORIZON_BLOCKS, validated_blocks
from defmanip_gym.validation import require_between, require_params, require_positive, settle


@dataclass(frozen=True, kw_only=True)
class MpcParams(WayLawParams):
    """Design choices of ``mpc``; with ``HorizonWeights``' they are what a study found.

    Attributes:
        way: the reference; its braking is the program's business, so it brakes hard.
        blocks: control periods for which the plan keeps an acceleration.
        weights: of the program.
        heading_share: of the task's tolerance, within which the heading at the goal costs nothing.
        sigma_share: of σ, up to which the plan may swing the object.
        acceleration_share: of the largest acceleration, up to which it may accelerate.
        tracking_gain: ε of Eq. (20) for the height, and for all axes where no plan is found, 1/s.
    """

    way: WayParams = field(
        default_factory=lambda: WayParams(
            turn_radius_m=3.75,
            yaw_rate_rad_s=2.18,
            deceleration_m_s2=4.48,
            vertical_deceleration_m_s2=1.15,
            approach_rate_per_s=4.69,
        )
    )
    blocks: tuple[int, ...] = HORIZON_BLOCKS
    weights: HorizonWeights = field(default_factory=HorizonWeights)
    heading_share: float = 0.6
    sigma_share: float = 0.9
    acceleration_share: float = 0.97
    tracking_gain: float = 4.0

    def __post_init__(self) -> None:
        super().__post_init__()
        settle(self, "blocks", validated_blocks)
        settle(self, "weights", require_params, HorizonWeights)
        for name in ("heading_share", "sigma_share", "acceleration_share"):
            settle(self, name, require_between, 0.0, 1.0)
        settle(self, "tracking_gain", require_positive, "1/s")
