"""Where the oriented field arrives from, and how soon, alone and inside the storage filter.

Suites ``nominal`` and ``far``, and random starts 0.5 to 18 m away in all directions with any
heading. Times are told as multiples of straight flight, the distance at full speed.

    python benchmarks/control/from_everywhere.py
    python benchmarks/control/from_everywhere.py --starts 100 --filters none
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from defmanip_gym.baselines.analytic.oriented import make_controller
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import NOMINAL, Scenario, suite_named
from defmanip_gym.wrappers.filter_for import filter_for

HORIZON_S = 30.0
NEAREST_M, FARTHEST_M = 0.5, 18.0
FIRST_SEED = 40_000_000  # of nobody else


def everywhere(count: int, seed: int) -> tuple[Scenario, ...]:
    """Return random starts, with arms and swings as those of suite ``nominal``."""
    rng = np.random.default_rng(seed)
    arms = np.array([scenario.start[3:] for scenario in suite_named("nominal").scenarios])
    distance = rng.uniform(NEAREST_M, FARTHEST_M, count)
    bearing, heading = rng.uniform(-np.pi, np.pi, (2, count))
    poses = np.column_stack((distance * np.cos(bearing), distance * np.sin(bearing), heading))
    starts = np.hstack((poses, arms[rng.integers(0, len(arms), count)]))
    return tuple(
        Scenario(name=f"{i:04d}", seed=FIRST_SEED + i, start=tuple(start), condition=NOMINAL)
        for i, start in enumerate(starts.tolist())
    )


def main() -> None:
    """Print a line for each set of starts and filter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=1000, help="random ones")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--filters", nargs="+", default=["none", "storage"])
    parser.add_argument("--failures", action="store_true", help="print starts that fail")
    arguments = parser.parse_args()
    config = TransportConfig()
    controller = make_controller(config)
    sets = {name: suite_named(name).scenarios for name in ("nominal", "far")}
    sets["everywhere"] = everywhere(arguments.starts, arguments.seed)
    for name, scenarios in sets.items():
        for kind in arguments.filters:
            episodes = rollout(
                Entry(suite=name, contestant="oriented", family="analytic"),
                controller,
                scenarios,
                config=config,
                horizon_s=HORIZON_S,
                safety_filter=filter_for(config) if kind == "storage" else None,
            )
            records = [episode.record for episode in episodes]
            good = [record for record in records if record.success]
            times = np.array([record.time_to_goal_s for record in good], dtype=np.float64)
            flights = np.array([r.start_distance_m / r.speed_limit_m_s for r in good])
            swing = max(record.largest_swing_share for record in records)
            print(
                f"{name:10s} {kind:8s} {dict(Counter(r.outcome for r in records))} "
                f"| median {np.median(times):.2f} s, 90 % {np.percentile(times, 90):.2f} s, "
                f"{np.median(times / flights):.2f} x flight | swing {swing:.2f} sigma",
                flush=True,
            )
            for record in records if arguments.failures else ():
                if not record.success:
                    print(f"  {record.outcome:10s}", np.round(record.start, 3).tolist())


if __name__ == "__main__":
    main()
