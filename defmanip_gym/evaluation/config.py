"""Settings of a comparison; their docstrings are the command line's help."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.suites import SUITE_NAMES, Suite, suite_named
from defmanip_gym.validation import (
    MOST_WORKERS,
    require_choice,
    require_flag,
    require_items,
    require_whole,
    settle,
)

_ALL: Literal["all"] = "all"


@dataclass(frozen=True, kw_only=True)
class ComparisonConfig:
    """Compare controllers on the same scenarios; a second run goes on where the first stopped.

    Examples:
        python evaluate.py

        python evaluate.py --suites all --episodes all --members all --output results/benchmark

        python evaluate.py --suites mismatch --contestants tanner/l1 ppo ppo/phase_plane

        python evaluate.py --contestants tanner my_module:make_controller/storage

        python evaluate.py --agents runs/DeformTransport-v0-sac-seed0 --output results/mine

        python evaluate.py --agents logs/ppo/best_model.zip --allow-pickle --output results/mine
    """

    output: Path = Path("results/compare")
    """Folder for records, tables, plots and report."""
    suites: tuple[str, ...] = ("nominal", "paper")
    """Names of suites: nominal, paper, mismatch, disturbed, far; or "all"."""
    episodes: int | Literal["all"] = 24
    """How many scenarios of each condition of a suite are run, the first ones; or "all"."""
    contestants: tuple[str, ...] | None = None
    """Names of those who take part; all by default. Or anybody's controllers as module:factory,
    each alone or, with a slash, inside a filter: my_package.my_module:make_controller/storage."""
    members: int | Literal["all"] = 3
    """How many agents of each learned contestant take part, lowest training seeds first; or
    "all"."""
    agents: tuple[Path, ...] = ()
    """Run folders or .safetensors files of further agents, run without and with certificate."""
    allow_pickle: bool = False
    """Also take zip files of SB3 and rl_zoo3 as --agents, with the VecNormalize files beside them.
    Loading one runs whatever code its maker put in, with your rights: only for files you trust."""
    normalization: str | None = None
    """VecNormalize file of the only agent, a zip file, or "none"; looked for beside it by
    default."""
    jobs: int | None = None
    """Processes; as many as cores by default, 1 stays in this one."""
    fresh: bool = False
    """Discard what an earlier run left in the output folder."""

    def __post_init__(self) -> None:
        settle(self, "suites", require_items, str)
        settle(self, "agents", require_items, Path)
        settle(self, "allow_pickle", require_flag)
        settle(self, "fresh", require_flag)
        if self.contestants is not None:
            settle(self, "contestants", require_items, str)
        for name in self.suites:
            require_choice("suites", name, (*SUITE_NAMES, _ALL))
        for name in ("episodes", "members"):
            value = getattr(self, name)
            if not (isinstance(value, str) and value == _ALL):
                settle(self, name, require_whole, 1)
        if self.normalization is not None and not (self.allow_pickle and len(self.agents) == 1):
            raise ParameterError(
                "normalization",
                self.normalization,
                "none unless --agents names one zip file, with --allow-pickle",
                "Compare several by putting the statistics of each beside it.",
            )
        if self.jobs is not None:
            settle(self, "jobs", require_whole, 1, MOST_WORKERS)

    @property
    def chosen_suites(self) -> tuple[Suite, ...]:
        """The suites in their own order, with the scenarios that are to be run."""
        names = SUITE_NAMES if _ALL in self.suites else self.suites
        whole = [suite_named(name) for name in SUITE_NAMES if name in names]
        if self.episodes == _ALL:
            return tuple(whole)
        return tuple(suite.first(self.episodes) for suite in whole)

    @property
    def member_limit(self) -> int | None:
        """Largest number of members of a contestant; None for no limit."""
        return None if self.members == _ALL else self.members

    @property
    def command(self) -> str:
        """The shell command that makes this comparison."""
        words = ["python", "evaluate.py"]
        for field in fields(self):
            value = getattr(self, field.name)
            if value == field.default or field.name in ("fresh", "jobs"):
                continue
            words.append(f"--{field.name.replace('_', '-')}")
            if value is not True:
                words += map(str, value if isinstance(value, tuple) else (value,))
        return shlex.join(words)
