"""Settings of ``defmanip agents``; their docstrings are the command line's help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from defmanip_gym.baselines.learned.families import SHIPPED
from defmanip_gym.errors import ParameterError


@dataclass(frozen=True, kw_only=True)
class AgentsConfig:
    """List the shipped agents, or show one agent's whole card.

    Examples:
        defmanip agents

        defmanip agents ppo/seed-0

        defmanip agents runs/DeformTransport-v0-sac-seed0 --json

        defmanip agents --score results/compare
    """

    name: tyro.conf.Positional[str | None] = None
    """An agent's name, run folder or file; all shipped ones by default."""
    json: bool = False
    """Print JSON."""
    score: Path | None = None
    """Output folder of an evaluation: write what it measured into the agents' cards."""
    library: Path = SHIPPED
    """Folder of families, in each seed-<k>.safetensors and .json; the package's own by default."""

    def __post_init__(self) -> None:
        if self.score is not None and self.name is not None:
            raise ParameterError(
                "score",
                str(self.score),
                "given without a name",
                "It writes the cards of every agent that took part.",
            )
