"""What it took to learn to be quick: PPO's recipe for v1 with one thing changed at a time.

    python benchmarks/learning/reward_ablation.py --jobs 2
    python benchmarks/learning/reward_ablation.py --variants "v0's reward" --seeds 0

Every variant is trained inside the storage filter, on the inner loop that feels the load, and
scored on the validation starts. Finished trainings are kept, and interrupted ones go on.
"""

from __future__ import annotations

import argparse
import copy
import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from defmanip_gym.envs.registration import QUICK_ENV_ID
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.run_folder import RunFolder
from defmanip_gym.training.trainings import train_or_go_on
from defmanip_gym.workers import running

Hyperparameters = dict[str, Any]
V0: Hyperparameters = {"task": {"reward": {}}}
APPROACH: Hyperparameters = {
    "task": {"reward": {"approach_speed_per_m": 4.0, "approach_swing_rad_per_m": 2.0}}
}


def rewarded(env_kwargs: Hyperparameters) -> Callable[[Hyperparameters], None]:
    """Return the change to another reward; v1's inner loop stays."""

    def change(hyperparameters: Hyperparameters) -> None:
        hyperparameters["env_kwargs"] = copy.deepcopy(env_kwargs)

    return change


def discounted(gamma: float) -> Callable[[Hyperparameters], None]:
    """Return the change to one discount from beginning to end."""

    def change(hyperparameters: Hyperparameters) -> None:
        hyperparameters["gamma"] = gamma
        hyperparameters["callback"] = [
            each for each in hyperparameters["callback"] if "RisingDiscount" not in str(each)
        ]

    return change


def both(*changes: Callable[[Hyperparameters], None]) -> Callable[[Hyperparameters], None]:
    """Return several changes as one."""

    def change(hyperparameters: Hyperparameters) -> None:
        for each in changes:
            each(hyperparameters)

    return change


def in_step(hyperparameters: Hyperparameters) -> None:
    """Let all episodes begin, and at first end, together."""
    hyperparameters["callback"] = [
        each for each in hyperparameters["callback"] if "Staggered" not in str(each)
    ]


VARIANTS: dict[str, Callable[[Hyperparameters], None]] = {
    "as it is": lambda hyperparameters: None,
    "v0's reward": rewarded(V0),
    "v0's reward, γ 0.955": both(rewarded(V0), discounted(0.955)),
    "approach 4, 2": rewarded(APPROACH),
    "approach 4, 2, γ 0.955": both(rewarded(APPROACH), discounted(0.955)),
    "γ 0.97": discounted(0.97),
    "γ 0.99": discounted(0.99),
    "episodes in step": in_step,
}


def training_of(variant: str, seed: int, timesteps: int, output: Path) -> TrainConfig:
    """Return how a variant is trained; its hyperparameters are written beside the run."""
    hyperparameters = copy.deepcopy(load_hyperparameters(None, "ppo", QUICK_ENV_ID))
    VARIANTS[variant](hyperparameters)
    folder = output / "".join(c if c.isalnum() else "-" for c in variant)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "ppo.yml"
    path.write_text(yaml.safe_dump({QUICK_ENV_ID: hyperparameters}))
    return TrainConfig(
        algo="ppo",
        env=QUICK_ENV_ID,
        seed=seed,
        filter="storage",
        total_timesteps=timesteps,
        hyperparameters=path,
        output=folder,
        num_threads=1,
    )


def evaluations(run: Path) -> list[tuple[float, float]]:
    """Return steps and score of each evaluation of a run."""
    found = []
    for part in sorted((run / "curves").glob("*/progress.csv")):
        with part.open(newline="") as file:
            for row in csv.DictReader(file):
                if row.get("eval/score"):
                    found.append((float(row["time/total_timesteps"]), float(row["eval/score"])))
    return found


def main() -> None:
    """Train what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--variants", nargs="+", choices=list(VARIANTS), default=list(VARIANTS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--timesteps", type=int, default=3_000_000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--output", type=Path, default=Path("results/reward_ablation"))
    words = parser.parse_args()
    runs = {
        variant: [training_of(variant, seed, words.timesteps, words.output) for seed in words.seeds]
        for variant in words.variants
    }
    with running(train_or_go_on, [r for own in runs.values() for r in own], words.jobs) as done:
        for _ in done:
            pass
    print("| PPO's recipe for v1 | seeds that arrive | best score, median (range) |")
    print("| --- | --- | --- |")
    for variant, own in runs.items():
        best = [max(s for _, s in evaluations(RunFolder.named(run).path)) for run in own]
        arrived = sum(score > 0.5 for score in best)
        print(
            f"| {variant} | {arrived} of {len(own)} "
            f"| {np.median(best):.3f} ({min(best):.3f} to {max(best):.3f}) |"
        )


if __name__ == "__main__":
    main()
