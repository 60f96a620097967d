"""Settings of ``defmanip ship``; their docstrings are the command line's help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from defmanip_gym.baselines.learned.families import SHIPPED
from defmanip_gym.errors import RunFolderError


@dataclass(frozen=True, kw_only=True)
class ShipConfig:
    """Copy the agents of finished training runs to the shipped ones, in place of earlier ones.

    Examples:
        defmanip ship runs/DeformTransport-v0-ppo-seed*
    """

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Run folders of train.py; each becomes <family>/seed-<k>, the family being the recipe, with
    -randomized for DeformTransportRandomized-v0 and the certificate's name where one was asked
    for."""
    library: Path = SHIPPED
    """Folder of families; the package's own by default."""

    def __post_init__(self) -> None:
        if not self.runs:
            raise RunFolderError("runs", self.runs, "at least one run folder", "Name some.")
