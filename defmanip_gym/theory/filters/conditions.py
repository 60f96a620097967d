"""What a safety filter takes for granted: about robot and sensors, and about the object."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.validation import require_number, require_range, require_whole, settle

LARGEST_ERROR = 1000.0
_LONGEST_DELAY = 50
_SMALLEST_FACTOR, LARGEST_FACTOR = 0.01, 100.0
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class FilterConditions:
    """Errors, noise and delay that a filter makes room for.

    A period's mean acceleration is what sampling makes of the command, and an offset. The filter
    counts on the offset of the period before; errors are its changes.

    Attributes:
        forward_error_m_s2: forward.
        lateral_error_m_s2: to the side.
        vertical_error_m_s2: upwards.
        forward_offset_m_s2: how far the forward offset may be from zero.
        vertical_offset_m_s2: and the vertical one.
        storage_error: of the storage after a period with just that acceleration, as a share of V_σ.
        swing_noise_rad: standard deviation of the measured swing angles.
        delay_periods: control periods until a command takes effect.
    """

    forward_error_m_s2: float = 0.17
    lateral_error_m_s2: float = 0.17
    vertical_error_m_s2: float = 0.15
    forward_offset_m_s2: float = 0.2
    vertical_offset_m_s2: float = 0.2
    storage_error: float = 0.0015
    swing_noise_rad: float = 0.0
    delay_periods: int = 0

    def __post_init__(self) -> None:
        for name in (
            "forward_error_m_s2",
            "lateral_error_m_s2",
            "vertical_error_m_s2",
            "forward_offset_m_s2",
            "vertical_offset_m_s2",
        ):
            settle(self, name, require_number, 0.0, LARGEST_ERROR, "m/s²")
        settle(self, "storage_error", require_number, 0.0, 1.0)
        settle(self, "swing_noise_rad", require_number, 0.0, 1.0, "rad")
        settle(self, "delay_periods", require_whole, 0, _LONGEST_DELAY)


@dataclass(frozen=True, kw_only=True)
class PayloadIntervals:
    """Constant but unknown factors (lowest, highest) on the parameters of the believed beam.

    Filters that know V only cover any damping, none included. Those that roll out the beam count on
    its own, and on what ``damping`` makes of it.

    Attributes:
        mass: on its mass.
        length: on its length.
        stiffness: on the stiffness at its root and in its joints.
        damping: on the damping at its root and in its joints; the lower one may be 0.
    """

    mass: tuple[float, float] = (1.0, 1.0)
    length: tuple[float, float] = (1.0, 1.0)
    stiffness: tuple[float, float] = (1.0, 1.0)
    damping: tuple[float, float] = (1.0, 1.0)

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            smallest = 0.0 if name == "damping" else _SMALLEST_FACTOR
            settle(self, name, require_range, smallest, LARGEST_FACTOR)
            low, high = getattr(self, name)
            if not low <= 1.0 <= high:
                raise ParameterError(
                    name, (low, high), "an interval around 1", "Factors are on the believed beam."
                )

    def corners(self, beam: BeamParams) -> tuple[BeamParams, ...]:
        """Return the beams that limit the storage, the believed one first.

        V over mass and length is that of a beam of mass 1 with stiffness over mass times length, so
        without springs mass does not matter. V less V_σ is convex in what is left.
        """
        masses, lengths, stiffnesses = (
            {*ends} for ends in (self.mass, self.length, self.stiffness)
        )
        sprung = beam.root_stiffness > 0 or (beam.segment_count > 1 and beam.joint_stiffness > 0)
        if not sprung:
            masses = stiffnesses = {1.0}
        made = (
            replace(
                beam,
                mass_kg=mass * beam.mass_kg,
                length_m=length * beam.length_m,
                root_stiffness=root * beam.root_stiffness,
                joint_stiffness=joint * beam.joint_stiffness,
            )
            for mass, length, root, joint in product(
                sorted(masses), sorted(lengths), sorted(stiffnesses), sorted(stiffnesses)
            )
        )
        return tuple(dict.fromkeys((beam, *made)))

    def dampings(self, beam: BeamParams) -> tuple[tuple[float, float], ...]:
        """Return dampings of root and joints, N·m·s/rad, at the interval's ends; the own first."""
        ends = tuple(sorted({*self.damping}))
        joints = ends if beam.segment_count > 1 else (1.0,)
        made = (
            (root * beam.damping, joint * beam.joint_damping)
            for root, joint in product(ends, joints)
        )
        return tuple(dict.fromkeys(((beam.damping, beam.joint_damping), *made)))

    def cover_damping(self, believed: BeamParams, carried: BeamParams) -> bool:
        """Whether a beam is damped as the believed one is within the interval."""
        low, high = self.damping
        pairs = [(believed.damping, carried.damping)]
        if believed.segment_count > 1:
            pairs.append((believed.joint_damping, carried.joint_damping))
        return all(low * own - _ROUNDING <= true <= high * own + _ROUNDING for own, true in pairs)

    def cover(self, believed: BeamParams, carried: BeamParams) -> bool:
        """Whether a beam is the believed one within the intervals."""
        same = replace(
            carried,
            mass_kg=believed.mass_kg,
            length_m=believed.length_m,
            damping=believed.damping,
            joint_damping=believed.joint_damping,
            root_stiffness=believed.root_stiffness,
            joint_stiffness=believed.joint_stiffness,
            radius_m=believed.radius_m,
        )
        return same == believed and all(
            low * own - _ROUNDING <= true <= high * own + _ROUNDING
            for (low, high), own, true in (
                (self.mass, believed.mass_kg, carried.mass_kg),
                (self.length, believed.length_m, carried.length_m),
                (self.stiffness, believed.root_stiffness, carried.root_stiffness),
                (self.stiffness, believed.joint_stiffness, carried.joint_stiffness),
            )
        )
