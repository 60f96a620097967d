"""Any velocity field, but straight to the goal when it is near.

Streamlines that arrive along +x turn ever more sharply beside the goal. A reference that follows
them there runs in circles, for the grasp's last centimetres need no course any more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.theory.control.velocity_field import VelocityField
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_positive, settle

_TINY = 1e-12


@dataclass(frozen=True, kw_only=True)
class SettlingField:
    """A field whose planar direction goes over to the goal's, at the field's speed.

    Attributes:
        field: from afar.
        radius_m: where both count the same.
    """

    field: VelocityField
    radius_m: float

    def __post_init__(self) -> None:
        settle(self, "radius_m", require_positive, "m")

    def velocity(self, p: Array, heading: Array | None = None) -> Array:
        """Return ż_1d in world axes, (..., 3) m/s, at ``p`` (..., 3) m from the goal."""
        velocity, planar = self.field.velocity(p, heading), p[..., :2]
        distance = np.hypot(planar[..., 0], planar[..., 1])
        speed = np.hypot(velocity[..., 0], velocity[..., 1])
        share = (distance**2 / (distance**2 + self.radius_m**2))[..., None]
        straight = -(speed / np.maximum(distance, _TINY))[..., None] * planar
        towards = share * velocity[..., :2] + (1.0 - share) * straight
        return np.concatenate((towards, velocity[..., 2:]), axis=-1)
