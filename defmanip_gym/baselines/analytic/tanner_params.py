"""Design choices of the paper's controller."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.validation import (
    require_choice,
    require_flag,
    require_number,
    require_params,
    require_positive,
    settle,
)

FieldKind = Literal["normalized", "literal", "oriented"]


@dataclass(frozen=True, kw_only=True)
class TannerParams:
    """Design choices of the controller that are not the robot's or the object's.

    The defaults are what a study found (docs/training.md).

    Attributes:
        velocity_field: ``"normalized"`` travels the dipole's streamlines with a speed profile,
            ``"literal"`` is −k ∇φ as printed, ``"oriented"`` leads by short ways along +x from
            anywhere, with any heading.
        literal_k: k of the literal field.
        tracking_gain: ε in L = −ε I, 1/s.
        approach_rate: speed per distance near the goal, 1/s.
        feedforward: add z̈_1d, the field's change along the motion; the paper has none.
        gains: k1 and k2 of the force loop (29).
        force_law_damping: d̂ assumed in the force law (10). Zero lets the force loop add damping;
            more than 4/3 of the true value destabilizes a uniform rod.
        acceleration_bound: bound on u_o where no certificate gives one, m/s².
        yaw_rate_bound: where no certificate gives one, rad/s.
        bound_share: share of the bounds that u_o uses, leaving the rest to the force loop.
        deceleration_share: share of the bound that the speed profile plans to brake with.
        speed_share: share of the speed limit that the field uses.
        turn_radius: R of the oriented field, m.
    """

    velocity_field: FieldKind = "normalized"
    literal_k: float = 1.0
    tracking_gain: float = 6.0
    approach_rate: float = 3.0
    feedforward: bool = True
    gains: ForceLoopGains = field(default_factory=lambda: ForceLoopGains(k1=0.05, k2=8.0))
    force_law_damping: float = 0.0
    acceleration_bound: float = 3.0
    yaw_rate_bound: float = 2.5
    bound_share: float = 0.85
    deceleration_share: float = 0.68
    speed_share: float = 0.9
    turn_radius: float = 1.5

    def __post_init__(self) -> None:
        require_choice("velocity_field", self.velocity_field, get_args(FieldKind))
        for name in (
            "literal_k",
            "tracking_gain",
            "approach_rate",
            "acceleration_bound",
            "yaw_rate_bound",
            "turn_radius",
        ):
            settle(self, name, require_positive)
        for name in ("bound_share", "deceleration_share", "speed_share"):
            settle(self, name, require_number, 1e-3, 1.0)
        settle(self, "feedforward", require_flag)
        settle(self, "gains", require_params, ForceLoopGains)
        settle(self, "force_law_damping", require_number, -1e4, 1e4, "N m s/rad")


# As first chosen, by hand: what shipped residual agents correct, and what the reproduction runs.
GENTLE_PARAMS = TannerParams(
    tracking_gain=2.0,
    approach_rate=0.5,
    gains=ForceLoopGains(k1=0.5, k2=2.0),
    acceleration_bound=1.0,
    yaw_rate_bound=1.0,
    bound_share=0.85,
    deceleration_share=0.5,
)
