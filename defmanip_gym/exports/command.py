"""``defmanip export``: load an agent, refuse what its network alone is not, write the file."""

from __future__ import annotations

from rich.console import Console

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.errors import AgentFileError
from defmanip_gym.exports.config import ExportConfig
from defmanip_gym.exports.onnx_graph import onnx_bytes
from defmanip_gym.files import write_atomically


def run_export(config: ExportConfig) -> None:
    """Write an agent's file and print what it is.

    Raises:
        AgentFileError: there is no such agent, its network alone is not the agent, or the file
            cannot be written.
        InstallationError: the package onnx is not installed.
        ModuleNotFoundError: SB3 is not installed.
    """
    actor = load_agent(config.agent)
    _require_whole(config.agent, actor)
    try:
        if config.format == "onnx":
            write_atomically(config.output, onnx_bytes(actor))
        else:
            from defmanip_gym.exports.sb3_file import write_sb3  # torch takes seconds

            write_sb3(config.output, actor)
    except OSError as error:
        raise AgentFileError(
            "output", str(config.output), "a file that can be written", f"{error}."
        ) from error
    console = Console()
    for line in _told(config, actor):
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def _require_whole(name: str, actor: MlpActor) -> None:
    """Raise AgentFileError if an agent is more than a function of the observation."""
    if actor.card.residual_authority_m_s2 is not None:
        raise AgentFileError(
            "agent",
            name,
            "one whose action depends on the observation alone",
            "A residual agent's network gives corrections, held for "
            f"{actor.card.residual_decision_periods} periods, of {actor.card.residual_base!r}, "
            "which has a memory: without it the file would be another agent. Use load_controller.",
        )


def _told(config: ExportConfig, actor: MlpActor) -> list[str]:
    lines = [f"Written: {config.output.resolve()}"]
    if config.format == "sb3":
        lines += [
            f"Its normalization: {config.output.stem}_vecnormalize.pkl beside it.",
            "Only the actor is the agent's: going on with the training begins with new critics. "
            "SB3 unpickles such files, so take them only from whom you trust.",
        ]
    if actor.card.trained_inside is not None:
        lines.append(
            f"It was trained inside {actor.card.trained_inside}, which is not in the file."
        )
    return lines
