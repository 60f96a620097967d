"""Settings of ``defmanip export``; their docstrings are the command line's help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import tyro

from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import require_choice

Format = Literal["onnx", "sb3"]
SUFFIXES = {"onnx": ".onnx", "sb3": ".zip"}


@dataclass(frozen=True, kw_only=True)
class ExportConfig:
    """Write an agent for programs that do not know this package.

    Examples:
        defmanip export sac --format onnx --output sac.onnx

        defmanip export ppo/seed-3 --format sb3 --output ppo.zip

        defmanip export runs/DeformTransport-v0-sac-seed0 --format onnx --output mine.onnx
    """

    agent: tyro.conf.Positional[str]
    """A shipped agent's name, a run folder or a .safetensors file, as defmanip agents takes it."""
    format: Format
    """onnx: the whole policy as a graph, float32. sb3: a zip file that SB3 loads, with the
    normalization beside it as <name>_vecnormalize.pkl."""
    output: Path
    """File that is written; an older one is replaced."""

    def __post_init__(self) -> None:
        require_choice("format", self.format, get_args(Format))
        suffix = SUFFIXES[self.format]
        if self.output.suffix != suffix:
            raise ParameterError(
                "output", str(self.output), f"a name that ends in {suffix}", "Others look for it."
            )
