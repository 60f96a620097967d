"""A family inside the filter that it was trained in, on all suites: what ``load_controller`` gives.

    python benchmarks/learning/inside_own_filter.py --family ppo-storage-randomized-v1

The benchmark puts the filter of a suite's condition around everybody; this is the one that was made
for all that the family's own environment draws.
"""

from __future__ import annotations

import argparse

import numpy as np

from defmanip_gym.baselines.learned.agents import load_controller
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.optimum import optimum_share
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import SUITES, Suite


def records(suite: Suite, agent: str) -> list[EpisodeRecord]:
    """Return the records of a suite."""
    controller, found = load_controller(agent), []
    for condition in suite.conditions:
        episodes = rollout(
            Entry(suite=suite.name, contestant=agent, family="learned"),
            controller,
            suite.of(condition),
            config=condition.environment_on("measured_force"),
            horizon_s=suite.horizon_s,
            delay_periods=condition.delay_periods,
        )
        found += [episode.record for episode in episodes]
    return found


def main() -> None:
    """Print a row for each suite and member."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--family", default="ppo-storage-randomized-v1")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(5)))
    words = parser.parse_args()
    print("| suite | seed | arrive | least of a condition | beyond σ | T/T*, median | largest |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for suite in SUITES:
        for seed in words.seeds:
            found = records(suite, f"{words.family}/seed-{seed}")
            shares = [optimum_share(record) for record in found]
            ratios = [1.0 / share for share in shares if share]
            least = min(
                np.mean([r.success for r in found if r.condition == condition.name])
                for condition in suite.conditions
            )
            print(
                f"| {suite.name} | {seed} | {sum(r.success for r in found)} of {len(found)} "
                f"| {100 * least:.0f} % | {sum(r.violated for r in found)} "
                f"| {np.median(ratios):.3f} | {max(ratios):.3f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
