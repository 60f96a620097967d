"""What Stable-Baselines3's default hyperparameters learn on v1, beside which the recipes stand.

    python benchmarks/learning/sb3_defaults.py --jobs 2
    python benchmarks/learning/steps_to_arrive.py results/sb3_defaults/*/Deform*

Everything that SB3 has a default for is left at it; observations and rewards are normalized and the
storage filter is around it, as the recipes have it. Eight environments for PPO, one for the others,
whose defaults ask for an update after each step. Finished trainings are kept, and interrupted ones
go on.
"""

from __future__ import annotations

import argparse
from inspect import signature
from pathlib import Path
from typing import Any, cast

import yaml
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC

from defmanip_gym.envs.registration import QUICK_ENV_ID
from defmanip_gym.training.config import Recipe, TrainConfig
from defmanip_gym.training.trainings import train_or_go_on
from defmanip_gym.workers import running

KINDS = {"ppo": PPO, "sac": SAC, "tqc": TQC}
ENVIRONMENTS = {"ppo": 8, "sac": 1, "tqc": 1}
STEPS = {"ppo": 8_000_000, "sac": 200_000, "tqc": 200_000}


def defaults(algo: str) -> dict[str, Any]:
    """Return a recipe of nothing but defaults."""
    parameters = signature(KINDS[algo]).parameters
    return {
        "n_envs": ENVIRONMENTS[algo],
        "n_timesteps": STEPS[algo],
        "policy": "MlpPolicy",
        "normalize": True,
        "learning_rate": parameters["learning_rate"].default,
        "gamma": parameters["gamma"].default,
    }


def training_of(algo: str, seed: int, output: Path) -> TrainConfig:
    """Return how it is trained; its hyperparameters are written beside the runs."""
    output.mkdir(parents=True, exist_ok=True)
    path = output / f"{algo}.yml"
    path.write_text(yaml.safe_dump({QUICK_ENV_ID: defaults(algo)}))
    return TrainConfig(
        algo=cast(Recipe, algo),
        env=QUICK_ENV_ID,
        seed=seed,
        filter="storage",
        hyperparameters=path,
        output=output,
        num_threads=1,
    )


def main() -> None:
    """Train what is missing."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--algos", nargs="+", choices=list(STEPS), default=list(STEPS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--output", type=Path, default=Path("results/sb3_defaults"))
    words = parser.parse_args()
    runs = [
        training_of(algo, seed, words.output / algo) for algo in words.algos for seed in words.seeds
    ]
    with running(train_or_go_on, runs, words.jobs) as done:
        for _ in done:
            pass


if __name__ == "__main__":
    main()
