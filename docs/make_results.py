"""Make docs/results.md from what ``make benchmark`` ran: ``python docs/make_results.py``.

It reads results/benchmark and runs nothing: records, tables and plots say it all.
"""

from __future__ import annotations

import csv
import re
import shutil
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.analysis import analyse
from defmanip_gym.evaluation.broken_certificates import broken_certificates
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.report.columns import COLUMNS, Column
from defmanip_gym.evaluation.report.filter_columns import FILTER_COLUMNS
from defmanip_gym.evaluation.report.sentences import answer, certificate_claim, suite_claims
from defmanip_gym.evaluation.store import read_records
from defmanip_gym.evaluation.suites import SUITES, Suite

DOCS = Path(__file__).parent
BENCHMARK = DOCS.parent / "results" / "benchmark"
IMAGES = "images/results"
_MACHINES_OWN = "Decision"  # columns with this heading hold wall times
_FIGURES = {
    "overview": "Score (IQM) of the best analytic and the best learned contestant inside filters.",
    "forest": "Score (IQM) of each contestant, with 95 % intervals.",
    "profiles": "Share of episodes that score above τ, for the best of each kind.",
    "conditions": "Score (IQM) by condition, for the best of each kind, with 95 % intervals.",
}

_HEAD = """# Results

{answer}

{overview}
Learned against analytic controllers on all suites, with all agents. `make benchmark` makes this
page: it runs

```sh
{command}
```

and then `python docs/make_results.py`, which takes everything from there. What suites, numbers and
intervals mean: [evaluation.md](evaluation.md). What each agent is: `defmanip agents`.

How to read it: a contestant's part after the slash is the safety filter around it; without a slash
there is none. After an @ stands the inner loop that it runs on, if not its own. Scores are mean
speeds towards the goal as a share of the speed limit; T*/T is the share of the time-optimal speed
from the same start ([optimum.md](optimum.md)). Both are 0 for an episode without success. A
sentence names a winner only where intervals separate it from everybody else in its class. Small
print in the tables: 95 % intervals. How long a decision takes depends on the machine, and is in the
report that `evaluate.py` writes.

{certificates}
"""


def write_results(benchmark: Path = BENCHMARK, docs: Path = DOCS) -> Path:
    """Write the page with its images and return its path.

    Args:
        benchmark: output folder of a comparison.
        docs: folder of the page.

    Raises:
        RecordError: the folder holds no whole comparison.
    """
    try:
        rows = list(csv.DictReader((benchmark / "summary.csv").read_text("utf-8").splitlines()))
        present = [suite for suite in SUITES if any(row["suite"] == suite.name for row in rows)]
        folder = benchmark / "tables"
        tables = {s.name: (folder / f"{s.name}.md").read_text("utf-8") for s in present}
        of_filters = {s.name: folder / f"{s.name}-filters.md" for s in present}
        command = re.search(r"^Made by `([^`]*)`", next(iter(tables.values())), re.M)
    except (OSError, KeyError, StopIteration) as error:
        raise RecordError(
            "benchmark", str(benchmark), "the output folder of `make benchmark`", f"{error!r}."
        ) from error
    assert command is not None  # every table names it
    order, records = {}, {}
    for suite in present:
        lines = [row for row in rows if row["suite"] == suite.name]
        own = {row["contestant"]: int(row["episodes"]) for row in lines}
        order[suite.name], records[suite.name] = list(own), _records(benchmark, suite, own)
    analyses = {
        suite.name: analyse(
            records[suite.name],
            suite.name,
            order=order[suite.name],
            certified=[name for name in order[suite.name] if "/" in name],
        )
        for suite in present
    }
    told = answer(tuple(analyses.values()))
    certificates = _certificates(records.values())
    picture = benchmark / "plots" / "overview.png"
    shown = _figure(picture, picture.stem, docs, command[1]) if picture.exists() else []
    parts = [
        _HEAD.format(
            answer=told, overview="\n".join(shown), command=command[1], certificates=certificates
        )
    ]
    for suite in present:
        analysis = analyses[suite.name]
        held = certificate_claim(records[suite.name])
        claims = (*suite_claims(analysis), *filter(None, [held]))
        parts += [
            f"## {suite.name}\n",
            f"{suite.description}\n",
            *(f"* {claim.text} {claim.detail}".rstrip() for claim in claims),
            "",
            *_figures(benchmark, docs, suite.name, command[1]),
            _without_wall_times(tables[suite.name], ["Contestant", *_titles(COLUMNS), "Knows"]),
        ]
        if of_filters[suite.name].exists():
            table = of_filters[suite.name].read_text("utf-8")
            parts += [
                "What each filter does to the controllers that ran both alone and inside it:\n",
                _without_wall_times(table, ["Filter", *_titles(FILTER_COLUMNS)]),
            ]
    page = docs / "results.md"
    page.write_text("\n".join(parts), encoding="utf-8")
    return page


def _records(benchmark: Path, suite: Suite, episodes: Mapping[str, int]) -> list[EpisodeRecord]:
    """Return the records that the tables are of; raise RecordError if there are others by now."""
    paths = sorted((benchmark / "records" / suite.name).glob("*.jsonl"))
    records = [record for path in paths for record in read_records(path)]
    found = Counter(record.contestant for record in records)
    for contestant, count in episodes.items():
        if found[contestant] != count:
            raise RecordError(
                f"episodes of {contestant} in {benchmark / 'records' / suite.name}",
                found[contestant],
                f"{count}, as in the tables",
                "Run `make benchmark` again; delete the records of members that are no more.",
            )
    return [record for record in records if record.contestant in episodes]


def _certificates(suites: Iterable[Sequence[EpisodeRecord]]) -> str:
    """Return what became of the certificates' promises, over all suites."""
    records = [record for suite in suites for record in suite]
    covered = sum(record.certificate_applies is True for record in records)
    broken = len(broken_certificates(records))
    return (
        f"Filters covered {covered} of {len(records)} episodes; σ was exceeded in "
        f"{broken or 'none'} of them."
    )


def _figures(benchmark: Path, docs: Path, suite: str, command: str) -> list[str]:
    """Copy the figures that matter and return their lines."""
    folder = benchmark / "plots" / suite
    second = "conditions" if (folder / "conditions.png").exists() else "profiles"
    return [
        line
        for name in ("forest", second)
        for line in _figure(folder / f"{name}.png", f"{suite}-{name}", docs, command)
    ]


def _figure(source: Path, target: str, docs: Path, command: str) -> list[str]:
    """Copy a figure and return its lines."""
    (docs / IMAGES).mkdir(parents=True, exist_ok=True)
    path, told = f"{IMAGES}/{target}.png", _FIGURES[source.stem]
    shutil.copyfile(source, docs / path)
    return [f"![{told}]({path})\n", f"{told} Made by `{command}`.\n"]


def _titles(columns: Sequence[Column[Any]]) -> list[str]:
    return [column.heading for column in columns]


def _without_wall_times(table: str, headings: Sequence[str]) -> str:
    """Return a Markdown table without the columns that depend on the machine."""
    kept = [heading != _MACHINES_OWN for heading in ("", *headings, "")]  # ends of the line, too
    lines = []
    for line in table.splitlines():
        cells = re.split(r"(?<!\\)\|", line)
        if len(cells) == len(kept):
            line = "|".join(cell for cell, keep in zip(cells, kept, strict=True) if keep)
        lines.append(line)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    try:
        print(write_results())
    except RecordError as error:
        sys.exit(str(error))
