"""How the plant of a scenario differs from what controllers and certificates believe."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from defmanip_gym.envs.config import InnerLoopKind, TransportConfig
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, DisturbanceParams
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.task_params import TaskParams
from defmanip_gym.validation import require_number, require_params, require_positive, settle

# What every controller, the inner loop and the certificates believe to carry.
NOMINAL_BEAM = BeamParams()

_LONGEST_DELAY_S = 10.0


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A plant: factors on the nominal beam, disturbances, and how late actions arrive.

    Attributes:
        name: unique within a suite.
        damping_factor: on the nominal beam's damping.
        mass_factor: on its mass.
        length_factor: on its length.
        disturbance: forces at the grasp and sensor noise.
        actuation_delay_s: by how much actions take effect later; whole control periods.

    Raises:
        ParameterError: a value out of range.
    """

    name: str
    damping_factor: float = 1.0
    mass_factor: float = 1.0
    length_factor: float = 1.0
    disturbance: DisturbanceParams = field(default_factory=DisturbanceParams)
    actuation_delay_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("damping_factor", "mass_factor", "length_factor"):
            settle(self, name, require_positive)
        settle(self, "disturbance", require_params, DisturbanceParams)
        settle(self, "actuation_delay_s", require_number, 0.0, _LONGEST_DELAY_S, "s")
        period_s = TaskParams().control_period_s
        if abs(self.delay_periods * period_s - self.actuation_delay_s) > 1e-9:
            raise ParameterError(
                "actuation_delay_s",
                self.actuation_delay_s,
                f"a whole multiple of the control period, {period_s:g} s",
                "Actions arrive at the beginning of a period.",
            )

    @property
    def delay_periods(self) -> int:
        """The delay in control periods."""
        return round(self.actuation_delay_s / TaskParams().control_period_s)

    @property
    def beam(self) -> BeamParams:
        """The beam that is really carried."""
        return replace(
            NOMINAL_BEAM,
            damping=self.damping_factor * NOMINAL_BEAM.damping,
            mass_kg=self.mass_factor * NOMINAL_BEAM.mass_kg,
            length_m=self.length_factor * NOMINAL_BEAM.length_m,
        )

    @property
    def environment(self) -> TransportConfig:
        """The environment; exceeding σ is a cost there and does not end episodes."""
        return TransportConfig(
            constraint_mode="cost",
            # as by default the inner loop counts on no damping, but here on no other truth either
            payload=RodPayload(beam=self.beam, nominal_beam=replace(NOMINAL_BEAM, damping=0.0)),
            disturbance=self.disturbance,
        )

    def environment_on(self, inner_loop: InnerLoopKind) -> TransportConfig:
        """Return the environment with the inner loop that a contestant runs on."""
        return replace(self.environment, inner_loop=inner_loop)


NOMINAL = Condition(name="nominal")
