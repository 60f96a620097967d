"""Environment throughput against the physics alone, as ratios taken in one run.

Candidates of a section take turns over several rounds, so that what else the machine does hits all
alike; every ratio is taken within a round, and printed with its smallest and largest. Actions are
stored, not sampled; episodes that end are reset by every candidate, and their resets are timed
(but not in the section marks); physics alone runs on the same model and as many threads, in states
that random forces reach from the environment's starts, none of which diverge.

    python benchmarks/speed/throughput.py
    python benchmarks/speed/throughput.py --sections batch core --num-envs 256 --control-modes force
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import tyro
from rich.console import Console
from rich.table import Table

from sections import SECTIONS, ThroughputConfig
from turns import Figure

_PACKAGES = ("defmanip_gym", "mujoco", "gymnasium", "numpy", "stable-baselines3", "envpool")


def measure(config: ThroughputConfig) -> dict[str, list[Figure]]:
    """Run the sections, print each when it is done, and return their figures."""
    console = Console(width=120)
    results: dict[str, list[Figure]] = {}
    for section in config.sections:
        try:
            results[section] = SECTIONS[section](config)
        except ImportError as error:
            extra = "bench" if section == "envpool" else "train"
            console.print(f"{section}: left out, {error}; install the extra: '.\\[{extra}]'")
            continue
        console.print(table(section, results[section]))
    if config.json is not None:
        write_json(config.json, results)
    return results


def table(title: str, figures: list[Figure]) -> Table:
    """Return the figures of a section, a line each."""
    lines = Table(title=title, title_justify="left")
    for heading in ("figure", "median", "smallest", "largest", "unit"):
        justify = "left" if heading in ("figure", "unit") else "right"
        lines.add_column(heading, justify=justify, no_wrap=True)
    for figure in figures:
        values = (_number(value) for value in (figure.value, figure.low, figure.high))
        lines.add_row(figure.name, *values, figure.unit)
    return lines


def write_json(path: Path, results: dict[str, list[Figure]]) -> None:
    """Write all figures, the versions behind them and the number of CPUs."""
    content = {
        "versions": {name: found for name in _PACKAGES if (found := _version(name))},
        "cpus": os.cpu_count(),
        "sections": {
            section: [asdict(figure) for figure in figures] for section, figures in results.items()
        },
    }
    path.write_text(json.dumps(content, indent=2) + "\n")


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


if __name__ == "__main__":
    measure(tyro.cli(ThroughputConfig, description=__doc__))
