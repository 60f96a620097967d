"""The evaluation's scenarios: six named suites, frozen, with seeds that nothing else uses."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from defmanip_gym.envs.starts import PAPER_START, StartSampler
from defmanip_gym.evaluation.conditions import NOMINAL, Condition
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED
from defmanip_gym.params import PAPER_DISTURBANCE, DisturbanceParams
from defmanip_gym.task_params import StartParams
from defmanip_gym.validation import require_choice, require_whole

HORIZON_S = 60.0  # of every suite

_SEEDS_PER_SUITE = 10_000
_FAR_DISTANCE_M = (12.0, 18.0)
_FAR_COUNT = 48
_DIRECTION_STEPS = (0.7548776662466927, 0.5698402909980532)
_DECIMALS = 6  # so that no platform's last digit makes another list

Start = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """One start under one condition, the same for every contestant.

    Attributes:
        name: unique within a suite.
        seed: of the episode's own randomness (sensor noise).
        start: (x, y, θ, q1, q2, φ), m and rad.
        condition: of the plant.
    """

    name: str
    seed: int
    start: Start
    condition: Condition


@dataclass(frozen=True, kw_only=True)
class Suite:
    """A frozen list of scenarios.

    Attributes:
        name: by which it is chosen.
        description: one sentence for readers.
        scenarios: those of a condition one after another.
        horizon_s: simulated seconds after which an episode times out.
    """

    name: str
    description: str
    scenarios: tuple[Scenario, ...]
    horizon_s: float = HORIZON_S

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Its conditions, in order."""
        return tuple(dict.fromkeys(scenario.condition for scenario in self.scenarios))

    @property
    def digest(self) -> str:
        """SHA-256 of the scenarios: of names, seeds, starts and conditions."""
        content = json.dumps([asdict(scenario) for scenario in self.scenarios], sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()

    def of(self, condition: Condition) -> tuple[Scenario, ...]:
        """Return the scenarios of a condition."""
        return tuple(s for s in self.scenarios if s.condition == condition)

    def first(self, count: int) -> Suite:
        """Return the suite with the first ``count`` scenarios of each condition only."""
        count = require_whole("episodes", count, 1)
        kept = (self.of(condition)[:count] for condition in self.conditions)
        return replace(self, scenarios=tuple(s for scenarios in kept for s in scenarios))


def _conditions(factor: str, *values: float) -> list[Condition]:
    name = factor.removesuffix("_factor")
    return [Condition(name=f"{name}-x{value:g}", **{factor: value}) for value in values]  # type: ignore[arg-type]


_PAPER = (
    Condition(name="simulated-damping", disturbance=PAPER_DISTURBANCE),
    Condition(name="design-damping", disturbance=PAPER_DISTURBANCE, damping_factor=10.0),
)
_MISMATCH = (
    *_conditions("damping_factor", 0.1, 0.3, 3.0, 10.0),
    *_conditions("mass_factor", 0.8, 1.2),
    *_conditions("length_factor", 0.8, 1.2),
)
# 5 rad/s is where the beam swings by itself; 2 N is a fifteenth of its weight
_OSCILLATION = {"force_amplitude_n": 2.0, "force_frequency_rad_s": 5.0}
# from half of what everybody believes to twice as much
_PAYLOAD = _conditions("mass_factor", 0.5, 0.7, 1.5, 2.0)
_DISTURBED = (
    Condition(name="force-oscillation", disturbance=DisturbanceParams(**_OSCILLATION)),
    Condition(name="force-bias", disturbance=DisturbanceParams(force_bias_n=2.0)),
    Condition(name="force-noise", disturbance=DisturbanceParams(force_sensor_noise_n=0.5)),
    Condition(name="swing-noise", disturbance=DisturbanceParams(swing_sensor_noise_rad=0.02)),
    Condition(name="delay-20ms", actuation_delay_s=0.02),
    Condition(name="delay-60ms", actuation_delay_s=0.06),
    Condition(
        name="all",
        actuation_delay_s=0.02,
        disturbance=DisturbanceParams(
            **_OSCILLATION,
            force_bias_n=2.0,
            force_sensor_noise_n=0.5,
            swing_sensor_noise_rad=0.02,
        ),
    ),
)


def _trained_start(seed: int) -> Start:
    """Draw a start as training does."""
    sampler = StartSampler(StartParams(), [np.random.default_rng(seed)])
    return _rounded(sampler.sample(np.arange(1))[0].tolist())


def _far_start(seed: int) -> Start:
    """Draw a start on a ring outside of the training's box.

    Bearings and headings follow a sequence of low discrepancy (the plastic number's), so that few
    starts point everywhere too.
    """
    index, shares = seed % _SEEDS_PER_SUITE, np.random.default_rng(seed).random(3).tolist()
    nearest, farthest = _FAR_DISTANCE_M
    distance = nearest + (farthest - nearest) * shares[0]
    bearing, heading = (
        math.tau * ((index * step + share / _FAR_COUNT) % 1.0) - math.pi
        for step, share in zip(_DIRECTION_STEPS, shares[1:], strict=True)
    )
    position = distance * math.cos(bearing), distance * math.sin(bearing)
    return _rounded((*position, heading, *_trained_start(seed)[3:]))


def _rounded(start: Sequence[float]) -> Start:
    return tuple(round(value, _DECIMALS) for value in start)


def _paper_start(seed: int) -> Start:
    return PAPER_START


def _scenarios(
    number: int, conditions: Sequence[Condition], count: int, start: Callable[[int], Start]
) -> tuple[Scenario, ...]:
    """Return ``count`` scenarios of each condition, with seeds of suite ``number``."""
    first = FIRST_EVALUATION_SEED + number * _SEEDS_PER_SUITE
    places = [(condition, index) for condition in conditions for index in range(count)]
    return tuple(
        Scenario(
            name=condition.name if count == 1 else f"{condition.name}-{index:02d}",
            seed=seed,
            start=start(seed),
            condition=condition,
        )
        for seed, (condition, index) in enumerate(places, start=first)
    )


SUITES = (
    Suite(
        name="nominal",
        description="Starts as in training; the plant is what controllers believe.",
        scenarios=_scenarios(0, [NOMINAL], 64, _trained_start),
    ),
    Suite(
        name="paper",
        description="The paper's start and disturbance, with the damping that the paper simulates "
        "(0.1 N·m·s/rad) and with the one that it designs for (1.0).",
        scenarios=_scenarios(1, _PAPER, 1, _paper_start),
    ),
    Suite(
        name="mismatch",
        description="Beams of another damping, mass or length than everybody believes.",
        scenarios=_scenarios(2, _MISMATCH, 8, _trained_start),
    ),
    Suite(
        name="disturbed",
        description="Forces at the grasp, sensor noise and late actuators, one by one and at once.",
        scenarios=_scenarios(3, _DISTURBED, 8, _trained_start),
    ),
    Suite(
        name="far",
        description="Starts 12 to 18 m from the goal, at any bearing with any heading, where no "
        "agent was trained.",
        scenarios=_scenarios(4, [NOMINAL], _FAR_COUNT, _far_start),
    ),
    Suite(
        name="payload",
        description="Beams of half to twice the mass that everybody believes.",
        scenarios=_scenarios(5, _PAYLOAD, 8, _trained_start),
    ),
)
SUITE_NAMES = tuple(suite.name for suite in SUITES)


def suite_named(name: str) -> Suite:
    """Return a suite.

    Raises:
        ParameterError: there is none of that name.
    """
    require_choice("suites", name, SUITE_NAMES)
    return SUITES[SUITE_NAMES.index(name)]
