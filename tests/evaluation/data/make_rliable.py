"""Writes rliable.json: what rliable computes on two fixed arrays, for tests to compare with.

rliable is no dependency of the project. In an environment of its own:

    pip install rliable==1.2.0 "pandas<3"     # arch 7.2.0, which rliable wants, breaks on pandas 3
    python tests/evaluation/data/make_rliable.py
"""

from __future__ import annotations

import json
import platform
import re
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rliable import library, metrics

SEED, RESAMPLES, PROFILE_RESAMPLES = 7, 100_000, 50_000
THRESHOLDS = (0.0, 0.2, 0.35, 0.5, 0.65, 0.8)
AGGREGATES = {
    "interquartile_mean": metrics.aggregate_iqm,
    "mean": metrics.aggregate_mean,
    "median": metrics.aggregate_median,
    "optimality_gap": metrics.aggregate_optimality_gap,
    "optimality_gap_0_6": partial(metrics.aggregate_optimality_gap, gamma=0.6),
}


def scores() -> dict[str, np.ndarray]:
    """Two algorithms on seven tasks, five and four runs; zeros are failures, two cells tie."""
    generator = np.random.default_rng(SEED)
    difficulty = generator.uniform(0.2, 0.7, 7)
    first = difficulty + generator.normal(0.05, 0.08, (5, 7))
    second = difficulty + generator.normal(0.0, 0.12, (4, 7))
    first[0, 2] = first[3, 6] = second[1, 2] = second[2, 5] = 0.0
    second[0, 3] = first[1, 3]
    return {"first": np.round(first, 3), "second": np.round(second, 3)}


def main() -> None:
    """Compute everything and write the file beside this one."""
    arrays = scores()
    np.random.seed(SEED)  # noqa: NPY002 - rliable draws its indices from NumPy's global state
    points: dict[str, dict[str, float]] = {}
    intervals: dict[str, dict[str, list[float]]] = {}
    for name, aggregate in AGGREGATES.items():
        point, interval = library.get_interval_estimates(
            arrays, lambda x, f=aggregate: np.array([f(x)]), reps=RESAMPLES
        )
        points[name] = {key: float(value[0]) for key, value in point.items()}
        intervals[name] = {key: value[:, 0].tolist() for key, value in interval.items()}
    pair = {"pair": (arrays["first"], arrays["second"])}
    improvement, improvement_interval = library.get_interval_estimates(
        pair, lambda x, y: np.array([metrics.probability_of_improvement(x, y)]), reps=10_000
    )
    profiles, bands = library.create_performance_profile(
        arrays, np.array(THRESHOLDS), reps=PROFILE_RESAMPLES
    )
    content = {
        "made_by": "python tests/evaluation/data/make_rliable.py",
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in ("rliable", "arch", "numpy", "scipy")},
        },
        "resamples": RESAMPLES,
        "scores": {key: value.tolist() for key, value in arrays.items()},
        "points": points,
        "intervals": intervals,
        "improvement": {
            "point": float(improvement["pair"][0]),
            "interval": improvement_interval["pair"][:, 0].tolist(),
            "resamples": 10_000,
        },
        "profiles": {
            "thresholds": list(THRESHOLDS),
            "resamples": PROFILE_RESAMPLES,
            "points": {key: value.tolist() for key, value in profiles.items()},
            "bands": {key: value.tolist() for key, value in bands.items()},
        },
    }
    rows_on_one_line = re.sub(
        r"\[[^\[\]]*\]", lambda row: re.sub(r"\s+", "", row[0]), json.dumps(content, indent=1)
    )
    path = Path(__file__).with_name("rliable.json")
    path.write_text(rows_on_one_line + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
