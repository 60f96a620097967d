"""What a certificate takes for granted: limits of the motion, intervals of the parameters."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.validation import require_number, require_range, settle

_LARGEST_FACTOR = 1000.0
_LARGEST_CONDITION = 1000.0


@dataclass(frozen=True, kw_only=True)
class CertificateConditions:
    """What a certificate takes for granted about the motion.

    Attributes:
        vertical_acceleration_m_s2: |vertical grasp acceleration| stays below this.
        yaw_rate_rad_s: |u2| stays below this.
        initial_swing_rad: every internal coordinate starts at most this far from its equilibrium.
        initial_swing_rate_rad_s: and at most this fast.
        acceleration_error_m_s2: forward acceleration stays this close to what it was meant to be.
        vertical_error_m_s2: the same for the vertical one.
    """

    vertical_acceleration_m_s2: float = 0.0
    yaw_rate_rad_s: float = 0.0
    initial_swing_rad: float = 0.0
    initial_swing_rate_rad_s: float = 0.0
    acceleration_error_m_s2: float = 0.0
    vertical_error_m_s2: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            settle(self, name, require_number, 0.0, _LARGEST_CONDITION)


# Room for the transport task: 0.43 m of lifting, one turn of some 70 degrees, sampled starts, and
# what disturbances and wild commands do within the control period in which they change.
TRANSPORT_CONDITIONS = CertificateConditions(
    vertical_acceleration_m_s2=0.05,
    yaw_rate_rad_s=0.3,
    initial_swing_rad=0.05,
    acceleration_error_m_s2=0.025,
    vertical_error_m_s2=0.02,
)


@dataclass(frozen=True, kw_only=True)
class ParameterIntervals:
    """Constant but unknown factors on an object's damping and elastic stiffness.

    Attributes:
        damping: (lowest, highest) factor on all of d_o22.
        stiffness: (lowest, highest) factor on all of k_o22; gravity's part is known.
    """

    damping: tuple[float, float] = (1.0, 1.0)
    stiffness: tuple[float, float] = (1.0, 1.0)

    def __post_init__(self) -> None:
        # factors on the object's own values, for instance (0.5, 2.0)
        for name in self.__dataclass_fields__:
            settle(self, name, require_range, 0.0, _LARGEST_FACTOR)

    @property
    def middle(self) -> ParameterIntervals:
        """The point in the middle."""
        damping, stiffness = (sum(ends) / 2 for ends in (self.damping, self.stiffness))
        return ParameterIntervals(damping=(damping, damping), stiffness=(stiffness, stiffness))


EXACT_PARAMETERS = ParameterIntervals()
