"""Attacks safety filters through the real environment, whatever they say that they cover.

Every case draws a beam of 1, 2, 4 or 8 segments with a damping from none to 1 N·m·s/rad, sensor
noise, delays, forces, or a beam that the filter knows within intervals only, and makes the filter
with ``filter_for``. A thousand attackers (``filter_attackers``) then play through it, a third of
them from starts whose storage is just the filter's level. A case is a line of the output; cases
that are there are not run again.

    python benchmarks/attacks/attack_filters.py --filter storage --cases 120
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.errors import DefmanipError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper
from filter_attackers import KINDS, Attackers

Rng = np.random.Generator
EPISODES = 1000  # of a case


def drawn_environment(rng: Rng) -> tuple[dict[str, Any], int]:
    """Return arguments of an environment, and control periods of delay."""
    segments = int(rng.choice([1, 1, 2, 4, 8]))
    sizes = {
        "mass_kg": float(rng.uniform(1.0, 5.0)),
        "length_m": float(rng.uniform(0.3, 0.9)),
        "damping": float(rng.choice([0.0, rng.uniform(0.0, 0.1), rng.uniform(0.1, 1.0)])),
    }
    beam = BeamParams(
        segment_count=segments,
        joint_stiffness=float(np.exp(rng.uniform(np.log(3.0), np.log(40.0)))),
        joint_damping=float(np.exp(rng.uniform(np.log(0.05), np.log(0.5)))),
        root_stiffness=float(rng.choice([0.0, 0.0, 3.0])),
        radius_m=min(0.02, 0.4 * sizes["length_m"] / segments),
        **sizes,
    )
    arguments: dict[str, Any] = {"beam": beam}
    delay, kind = 0, rng.choice(["plain", "noise", "delay", "force", "ranges", "all"])
    if kind in ("noise", "all") and segments == 1:
        arguments["disturbance"] = DisturbanceParams(swing_sensor_noise_rad=0.01)
    if kind in ("delay", "all"):
        delay = int(rng.integers(1, 4))
    if kind == "force":
        arguments["disturbance"] = DisturbanceParams(
            force_amplitude_n=float(rng.uniform(0, 2)),
            force_frequency_rad_s=float(rng.uniform(1, 10)),
            force_bias_n=float(rng.uniform(0, 2)),
        )
    if kind == "ranges":
        arguments["beam_ranges"] = BeamRanges(
            **{name: (0.9 * size, 1.1 * size) for name, size in sizes.items()}
        )
    return arguments, delay


def starts(env: Any, made: StorageFilter, layout: ObservationLayout, rng: Rng) -> np.ndarray:
    """Return starts, (n, 6): sampled ones, a third of them with the level's storage at rest."""
    config = env.unwrapped.config
    center, spread = np.array(config.task.start.center), np.array(config.task.start.spread)
    drawn = center + spread * rng.uniform(-1, 1, (EPISODES, 6))
    swings = np.linspace(0, made.sigma_rad, 500)
    shapes = np.repeat(swings[:, None], layout.segment_count, axis=1)
    shares = made.shares_of(shapes, 0 * shapes, 0 * swings)
    highest = swings[np.searchsorted(shares, 0.999) - 1]
    loaded = rng.random(EPISODES) < 1 / 3
    drawn[loaded, 5] = highest * rng.choice((-1.0, 1.0), loaded.sum())
    return drawn


def run_case(kind: type[StorageFilter], seed: int, steps: int) -> dict[str, Any]:
    """Attack one environment; return what happened."""
    rng = np.random.default_rng(seed)
    arguments, delay = drawn_environment(rng)
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=EPISODES,
        autoreset_mode="Disabled",
        constraint_mode="cost",
        max_episode_steps=steps + 1,
        **arguments,
    )
    made = filter_for(env.unwrapped.config, kind=kind, delay_periods=delay)
    wrapped = SafetyFilterVectorWrapper(ActionDelay(env, delay), made)
    layout = ObservationLayout(arguments["beam"].segment_count)
    observation, info = wrapped.reset(
        seed=1000 * seed, options={"start": starts(env, made, layout, rng)}
    )
    attackers = Attackers(layout, EPISODES, rng)
    running, ever = np.ones(EPISODES, dtype=bool), info["filter_applies"].copy()
    broken, beyond, withdrawn = (np.zeros(EPISODES, dtype=bool) for _ in range(3))
    largest = np.zeros(EPISODES)
    for step in range(steps if info["filter_applies"].any() else 0):
        observation, _, terminated, _, info = wrapped.step(attackers.act(observation, step))
        applies = info["filter_applies"]
        share = 1 - info["constraint_margin"] / made.sigma_rad
        ever |= running & applies
        broken |= running & applies & (share > 1)
        beyond |= running & ever & (share > 1)
        withdrawn |= running & ever & ~applies
        covered = running & applies
        largest[covered] = np.maximum(largest[covered], share[covered])
        running &= ~(terminated | info["simulation_failed"])
    wrapped.close()
    worst: dict[str, float] = {}
    for index, name in enumerate(KINDS):
        worst[name] = round(float(largest[attackers.kinds == index].max(initial=0.0)), 4)
    return {
        "seed": seed,
        "segments": layout.segment_count,
        "damping": arguments["beam"].damping,
        "varied": sorted(set(arguments) - {"beam"}) + [f"delay {delay}"] * bool(delay),
        "level_share": made.level_share,
        "applies": int(ever.sum()),
        "withdrawn": int(withdrawn.sum()),
        "broken": int(broken.sum()),
        "exceeded_after_withdrawal": int((beyond & ~broken).sum()),
        "largest_swing_share": float(largest.max()),
        "by_attacker": worst,
        "reason": str(info["filter_reason"][0]),
    }


def main() -> None:
    """Run the cases that are missing and print the sums."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--filter", choices=STORAGE_FILTERS, default="storage")
    parser.add_argument("--cases", type=int, default=120)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--steps", type=int, default=250)
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    output = options.output or Path(f"results/attacks-{options.filter}.jsonl")
    output.parent.mkdir(parents=True, exist_ok=True)
    lines = output.read_text().splitlines() if output.exists() else []
    known = {record["seed"]: record for record in map(json.loads, lines)}
    for seed in range(options.first, options.first + options.cases):
        if seed in known:
            continue
        try:
            known[seed] = run_case(STORAGE_FILTERS[options.filter], seed, options.steps)
        except DefmanipError as error:  # no filter for such an environment
            known[seed] = {"seed": seed, "refused": f"{type(error).__name__}: {error}"}
        with output.open("a") as file:
            file.write(json.dumps(known[seed]) + "\n")
    _print_sums(list(known.values()))


def _print_sums(records: list[dict[str, Any]]) -> None:
    run = [record for record in records if "refused" not in record]
    print(f"cases: {len(records)}, without a filter: {len(records) - len(run)}")
    by_segments = defaultdict(list)
    for record in run:
        by_segments[record["segments"]].append(record)
    for segments, group in sorted(by_segments.items()):
        sums = {
            name: sum(record[name] for record in group)
            for name in ("applies", "withdrawn", "broken", "exceeded_after_withdrawal")
        }
        largest = max(record["largest_swing_share"] for record in group)
        print(f"N = {segments}: {len(group)} cases, episodes {sums}, largest swing {largest:.4f} σ")


if __name__ == "__main__":
    main()
