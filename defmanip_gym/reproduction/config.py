"""Settings of the reproduction; their docstrings are the command line's help."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from defmanip_gym.validation import require_flag, require_number, settle

# 11 hours of the paper's time; the transport converges before
_LONGEST_S = 40_000.0


@dataclass(frozen=True, kw_only=True)
class ReproductionConfig:
    """Run the paper's simulation on its own time scale; write Figures 2 to 5 and a page.

    A second run reuses the parts that an earlier one has finished.

    Examples:
        defmanip reproduce

        defmanip reproduce --output-dir results/again --fresh

        defmanip reproduce --max-duration-s 300 --output-dir results/quick
    """

    output_dir: Path = Path("results/reproduction")
    """Folder for figures, page, numbers and time series."""
    max_duration_s: float = _LONGEST_S
    """Simulated seconds after which every part stops, converged or not."""
    fresh: bool = False
    """Discard what an earlier run left in the output folder."""

    def __post_init__(self) -> None:
        settle(self, "fresh", require_flag)
        settle(self, "max_duration_s", require_number, 1.0, 1e6, "s")

    @property
    def command(self) -> str:
        """The shell command that makes this reproduction."""
        words = ["defmanip", "reproduce"]
        for name in ("output_dir", "max_duration_s"):
            value = getattr(self, name)
            if value != type(self).__dataclass_fields__[name].default:
                words += [f"--{name.replace('_', '-')}", str(value)]
        return shlex.join(words)
