"""What an attack found."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.attack.crossing import ACCURACY
from defmanip_gym.attack.target import InputLimits, PlantFactors
from defmanip_gym.theory.dynamics.chain import Array


@dataclass(frozen=True, kw_only=True)
class AttackResult:
    """The worst admissible input found for an object.

    Attributes:
        sigma: σ, the deformation that must not be exceeded, rad (m for slides).
        certified_bound: acceleration bound under attack, m/s², without the acceleration error.
        peak_at_bound: largest |z2| reached with inputs within the certificate, rad.
        violating_bound: smallest acceleration bound at which |z2| > σ was reached, m/s²; infinite
            if no attack got there.
        method: the attack that reached ``violating_bound``.
        coordinate: the internal coordinate that it deforms.
        limits: the limits of the attack at ``violating_bound``.
        inputs: that attack, (steps, 4): forward, left, up m/s² in the yawing frame, rad/s of yaw.
        start: (z2, ż2) that it starts from, (2N,).
        timestep_s: how long each row of ``inputs`` holds.
        plant: the plant it was found on.
        cpu_seconds: processor time the search took.
    """

    sigma: float
    certified_bound: float
    peak_at_bound: float
    violating_bound: float
    method: str
    coordinate: str
    limits: InputLimits
    inputs: Array
    start: Array
    timestep_s: float
    plant: PlantFactors
    cpu_seconds: float

    @property
    def is_broken(self) -> bool:
        """Whether an input within the certificate deformed the object beyond σ."""
        # smaller inputs are within it, too, and may do what larger ones do not
        return self.peak_at_bound > self.sigma or self.violating_bound <= self.certified_bound

    @property
    def withstood_bound(self) -> float:
        """Largest bound, m/s² and no larger than the certified one, that no attack found broke."""
        if not self.is_broken:
            return self.certified_bound
        below = self.violating_bound - ACCURACY * self.limits.forward_m_s2
        return min(below, (1 - ACCURACY) * self.certified_bound)

    @property
    def tightness(self) -> float:
        """Certified over violating bound: at 1 no larger bound would be safe."""
        return self.certified_bound / self.violating_bound
