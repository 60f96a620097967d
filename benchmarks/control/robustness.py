"""What plants do to controllers that believe in the nominal one: cures alone and together, limits.

The first table is the share of episodes that arrive within sigma and the median time of those, by
condition: the paper's controller as tuned, then the outer loop of ``field`` with Eq. (28) or the
measured force inside, without and with the observer, and an agent. The second one goes on until
less than 95 % arrive.

    python benchmarks/control/robustness.py
    python benchmarks/control/robustness.py --starts 48 --only limits
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from statistics import median

from defmanip_gym.baselines.analytic.field import FieldController, FieldParams
from defmanip_gym.baselines.analytic.tanner import TannerController
from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.learned.agents import load_controller
from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.evaluation.conditions import NOMINAL, NOMINAL_BEAM, Condition
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.params import DisturbanceParams

HORIZON_S = 30.0
ENOUGH = 0.95


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A controller on an inner loop."""

    name: str
    controller: Controller
    inner_loop: InnerLoopKind


def variants() -> tuple[Variant, ...]:
    """Return the cures alone and together, and a learned agent on both inner loops."""

    def field(inner_loop: InnerLoopKind, observer_gain: float) -> FieldController:
        return FieldController(
            params=FieldParams(inner_loop=inner_loop, observer_gain_per_s=observer_gain)
        )

    own = FieldParams().observer_gain_per_s
    return (
        Variant(name="tanner", controller=TannerController(beam=NOMINAL_BEAM), inner_loop="model"),
        Variant(name="(28) alone", controller=field("model", 0.0), inner_loop="model"),
        Variant(name="(28), observer", controller=field("model", own), inner_loop="model"),
        Variant(
            name="force alone", controller=field("measured_force", 0.0), inner_loop="measured_force"
        ),
        Variant(
            name="force, observer",
            controller=field("measured_force", own),
            inner_loop="measured_force",
        ),
        Variant(name="(28), sac", controller=load_controller("sac"), inner_loop="model"),
        Variant(name="force, sac", controller=load_controller("sac"), inner_loop="measured_force"),
    )


def factors(name: str, *values: float) -> list[Condition]:
    """Return conditions with a factor on one of the beam's parameters."""
    return [
        Condition(name=f"{name} ×{value:g}", **{f"{name}_factor": value})  # type: ignore[arg-type]
        for value in values
    ]


def conditions() -> list[Condition]:
    """Return the conditions that a robust controller has to stand."""
    return [
        NOMINAL,
        *factors("mass", 0.5, 0.8, 1.2, 1.5, 2.0),
        *factors("length", 0.8, 1.2),
        *factors("damping", 0.1, 10.0),
        *suite_named("disturbed").conditions,
    ]


def ladders() -> dict[str, list[Condition]]:
    """Return conditions of growing size, by what grows."""

    def disturbed(name: str, unit: str, *sizes: float) -> list[Condition]:
        return [
            Condition(name=f"{size:g} {unit}", disturbance=DisturbanceParams(**{name: size}))  # type: ignore[arg-type]
            for size in sizes
        ]

    return {
        "lighter": factors("mass", 0.8, 0.75, 0.7, 0.5, 0.1, 0.03),
        "heavier": factors("mass", 1.2, 1.3, 2.0, 4.0, 6.0, 6.5, 7.0, 8.0),
        "longer": factors("length", 1.5, 2.0, 2.5, 3.0),
        "delay": [
            Condition(name=f"{20 * periods} ms", actuation_delay_s=0.02 * periods)
            for periods in range(3, 10)
        ],
        "bias": disturbed("force_bias_n", "N", 5.0, 10.0, 12.5, 15.0, 20.0, 30.0),
        "force noise": disturbed("force_sensor_noise_n", "N", 2.0, 5.0, 10.0, 20.0, 40.0),
        "swing noise": disturbed("swing_sensor_noise_rad", "rad", 0.1, 0.2, 0.5, 1.0),
    }


def records(variant: Variant, condition: Condition, starts: int) -> list[EpisodeRecord]:
    """Return what a variant makes of a condition, from the first starts of the suite nominal."""
    scenarios = suite_named("nominal").scenarios[:starts]
    episodes = rollout(
        Entry(suite="nominal", contestant=variant.name, family="analytic"),
        variant.controller,
        [replace(scenario, condition=condition) for scenario in scenarios],
        config=condition.environment_on(variant.inner_loop),
        horizon_s=HORIZON_S,
        delay_periods=condition.delay_periods,
    )
    return [episode.record for episode in episodes]


def share(found: Iterable[EpisodeRecord]) -> float:
    """Return the share of successes."""
    successes = [record.success for record in found]
    return sum(successes) / len(successes)


def cell(found: list[EpisodeRecord]) -> str:
    """Return the share of successes in percent and their median time in s."""
    times = [record.time_to_goal_s for record in found if record.success]
    return f"{100 * share(found):.0f} · {median(times):.1f}" if times else "0"


def print_cures(starts: int) -> None:
    """Print success and time of all variants by condition."""
    columns = variants()
    print("| condition | " + " | ".join(variant.name for variant in columns) + " |")
    print("| --- |" + " --- |" * len(columns))
    for condition in conditions():
        cells = (cell(records(variant, condition, starts)) for variant in columns)
        print(f"| {condition.name} | " + " | ".join(cells) + " |", flush=True)


def print_limits(starts: int) -> None:
    """Print where success falls below 95 %, and what happens there instead."""
    observing = [variant for variant in variants() if variant.name.endswith("observer")]
    print("| what grows | inner loop | last with 95 % | first with less | what happens there |")
    print("| --- | --- | --- | --- | --- |")
    for name, conditions_up in ladders().items():
        for variant in observing:
            last, first, told = "–", "–", ""
            for condition in conditions_up:
                found = records(variant, condition, starts)
                if share(found) < ENOUGH:
                    counts = Counter(record.outcome for record in found)
                    first = f"{condition.name} ({100 * share(found):.0f} %)"
                    told = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
                    break
                last = condition.name
            print(f"| {name} | {variant.inner_loop} | {last} | {first} | {told} |", flush=True)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--starts", type=int, default=16)
    parser.add_argument("--only", choices=("cures", "limits"))
    options = parser.parse_args()
    if options.only != "limits":
        print_cures(options.starts)
        print()
    if options.only != "cures":
        print_limits(options.starts)


if __name__ == "__main__":
    main()
