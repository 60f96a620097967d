"""How much training it takes until 95 % of the validation starts succeed.

    python benchmarks/learning/steps_to_arrive.py runs/*

prints a row for each recipe: the median over its runs of environment steps and minutes until the
first evaluation with so much success, and of whole runs. Steps are the environment's: a decision
that is held for several of them counts as many.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from defmanip_gym.training.export import residual_of
from defmanip_gym.training.run_folder import RunFolder

NEVER = float("inf")


@dataclass(frozen=True, kw_only=True)
class Course:
    """Of one run: steps and minutes until it arrives, and of all of it."""

    steps: float
    minutes: float
    all_steps: float
    all_minutes: float


def course(run: Path, share: float) -> Course:
    """Read a run's curves; parts that begin where a run was resumed count their own seconds."""
    residual = residual_of(RunFolder(run).read_config().hyperparameters)
    periods = residual.decision_periods if residual else 1
    steps = minutes = NEVER
    before = now = last = 0.0
    for part in sorted((run / "curves").glob("*/progress.csv")):
        before += now
        now = 0.0
        with part.open(newline="") as file:
            for row in csv.DictReader(file):
                now = float(row.get("time/time_elapsed") or now)
                last = float(row.get("time/total_timesteps") or last)
                arrived = float(row.get("eval/success_rate") or 0.0)
                if arrived >= share and steps == NEVER:
                    steps, minutes = periods * last, (before + now) / 60
    return Course(
        steps=steps,
        minutes=minutes,
        all_steps=periods * last,
        all_minutes=(before + now) / 60,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--share", type=float, default=0.95, help="of the validation starts")
    words = parser.parse_args()
    recipes: dict[str, list[Course]] = defaultdict(list)
    for run in words.runs:
        recipes[run.name.rpartition("-seed")[0]].append(course(run, words.share))
    print("| recipe | runs that arrive | steps until then | minutes | all steps | all minutes |")
    print("| --- | --- | --- | --- | --- | --- |")
    for recipe, courses in recipes.items():
        arrived = sum(each.steps < NEVER for each in courses)
        steps, minutes, all_steps, all_minutes = (
            np.median([getattr(each, name) for each in courses])
            for name in ("steps", "minutes", "all_steps", "all_minutes")
        )
        told = f"{steps:,.0f} | {minutes:.1f}" if steps < NEVER else "– | –"
        print(
            f"| {recipe} | {arrived} of {len(courses)} | {told} "
            f"| {all_steps:,.0f} | {all_minutes:.1f} |"
        )


if __name__ == "__main__":
    main()
