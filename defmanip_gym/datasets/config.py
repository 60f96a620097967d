"""Settings of ``defmanip dataset``; their docstrings are the command line's help."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import tyro

from defmanip_gym.envs.config import ConstraintMode
from defmanip_gym.envs.registration import ENV_ID, ENV_IDS
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.seeds import LARGEST_DATASET_SEED, MOST_DATASET_EPISODES
from defmanip_gym.validation import (
    require_choice,
    require_flag,
    require_items,
    require_positive,
    require_whole,
    settle,
)

_ALL: Literal["all"] = "all"
_DATASET_ID = re.compile(r"([-\w]{2,}/)*[-\w]+-v\d+", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class DatasetConfig:
    """Write episodes of contestants as a Minari dataset, or simulate the actions of one again.

    Examples:
        defmanip dataset deform-transport/analytic-v0 --contestants field --output datasets

        defmanip dataset deform-transport/mixed-v0 --contestants field random --shares 3 1

        defmanip dataset deform-transport/safe-v0 --contestants sac/storage --members all

        defmanip dataset --check deform-transport/mixed-v0 --output datasets
    """

    name: tyro.conf.Positional[str | None] = None
    """Id of the dataset that is written, such as deform-transport/mixed-v0."""
    check: str | None = None
    """Id or folder of a dataset: simulate its actions again, and compare bit for bit."""
    contestants: tuple[str, ...] = ()
    """Who controls, as evaluate.py --contestants names them; several give a mixture."""
    agents: tuple[Path, ...] = ()
    """Run folders or .safetensors files of further agents that control, each inside the filter
    that it learned in, if any."""
    shares: tuple[float, ...] | None = None
    """Shares of the episodes, one for each contestant and then each agent; equal by default."""
    members: int | Literal["all"] = 1
    """How many agents of each learned contestant take part, lowest training seeds first; or
    "all". A contestant's episodes are dealt to them in turn."""
    env: str = ENV_ID
    """Environment id; DeformTransportRandomized-v0 draws every episode's damping and mass."""
    constraint_mode: ConstraintMode = "terminate"
    """What exceeding σ does: end the episode, cost reward (penalty), or nothing (cost)."""
    episodes: int = 100
    """How many."""
    seed: int = 0
    """Of starts and of random actions; no other seed, and no suite, has the same episodes."""
    output: Path | None = None
    """Folder of Minari datasets; Minari's own by default: MINARI_DATASETS_PATH, or
    ~/.minari/datasets."""
    overwrite: bool = False
    """Replace a dataset of that id."""

    def __post_init__(self) -> None:
        if (self.name is None) == (self.check is None):
            raise ParameterError(
                "dataset",
                (self.name, self.check),
                "an id to write, or --check with an id or folder",
                "Name one of them: defmanip dataset deform-transport/mine-v0.",
            )
        if self.name is not None and not _DATASET_ID.fullmatch(self.name):
            raise ParameterError(
                "dataset id",
                self.name,
                "letters, digits, - and _, ending in -v and a number, a slash after the namespace",
                "As in deform-transport/mixed-v0.",
            )
        settle(self, "contestants", require_items, str)
        settle(self, "agents", require_items, Path)
        if self.name is not None and not self.controlling:
            raise ParameterError(
                "contestants", (), "at least one, or --agents", "As in --contestants field."
            )
        if len(set(self.controlling)) < len(self.controlling):
            raise ParameterError(
                "contestants", self.contestants, "each of them once", "Use --shares."
            )
        if self.shares is not None:
            self._check_shares(self.shares)
        if self.members != _ALL:
            settle(self, "members", require_whole, 1)
        require_choice("env", self.env, ENV_IDS)
        require_choice("constraint_mode", self.constraint_mode, get_args(ConstraintMode))
        settle(self, "episodes", require_whole, 1, MOST_DATASET_EPISODES)
        settle(self, "seed", require_whole, 0, LARGEST_DATASET_SEED)
        settle(self, "overwrite", require_flag)

    def _check_shares(self, shares: tuple[float, ...]) -> None:
        count = len(self.controlling)
        if len(shares) != count:
            raise ParameterError(
                "shares", shares, f"{count} numbers, one for each contestant", "Give as many."
            )
        object.__setattr__(self, "shares", tuple(require_positive("shares", s) for s in shares))

    @property
    def controlling(self) -> tuple[str | Path, ...]:
        """Contestants and agents in the order of their shares."""
        return (*self.contestants, *self.agents)

    @property
    def member_limit(self) -> int | None:
        """Largest number of members of a contestant; None for no limit."""
        return None if self.members == _ALL else self.members
