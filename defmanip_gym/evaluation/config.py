"""Settings of a comparison; their docstrings are the command line's help."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass, fields
from pathlib import Path

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import PAPER_DISTURBANCE, BeamParams
from defmanip_gym.validation import require_positive, require_whole


@dataclass(frozen=True, kw_only=True)
class ComparisonConfig:
    """Compare controllers on the same starts; a second run goes on where the first stopped.

    Examples:
        python evaluate.py

        python evaluate.py --contestants tanner/l1 ppo --episodes 100 --output results/long

        python evaluate.py --agents runs/DeformTransport-v0-sac-seed0 --output results/mine
    """

    output: Path = Path("results/compare")
    """Folder for records, table, plots and report."""
    episodes: int = 24
    """Scenarios for each contestant: the paper's start and sampled ones."""
    horizon_s: float = 60.0
    """Simulated seconds after which an episode times out."""
    contestants: tuple[str, ...] | None = None
    """Names of those who take part; all by default."""
    agents: tuple[Path, ...] = ()
    """Run folders or .safetensors files of further agents, run without and with the wrapper."""
    sigma_rad: float = math.pi / 6
    """Admissible swing σ."""
    damping: float = 0.1
    """Damping of the plant's beam in N·m·s/rad; the paper designs with 1.0 and simulates 0.1."""
    fresh: bool = False
    """Discard what an earlier run left in the output folder."""

    def __post_init__(self) -> None:
        require_whole("episodes", self.episodes, 1)
        require_positive("horizon_s", self.horizon_s, "s")

    @property
    def environment(self) -> TransportConfig:
        """The environment, with the paper's disturbances."""
        return TransportConfig(
            constraint_mode="cost",
            sigma_rad=self.sigma_rad,
            beam=BeamParams(damping=self.damping),
            disturbance=PAPER_DISTURBANCE,
        )

    @property
    def step_count(self) -> int:
        """Control periods until the horizon."""
        return max(1, round(self.horizon_s / self.environment.task.control_period_s))

    @property
    def command(self) -> str:
        """The shell command that makes this comparison."""
        words = ["python", "evaluate.py"]
        for field in fields(self):
            value = getattr(self, field.name)
            if value == field.default or field.name == "fresh":
                continue
            values = value if isinstance(value, tuple) else (value,)
            words += [f"--{field.name.replace('_', '-')}", *map(str, values)]
        return shlex.join(words)
