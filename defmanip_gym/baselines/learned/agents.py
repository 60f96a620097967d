"""Finding agents: shipped ones by name, others by path."""

from __future__ import annotations

import zipfile
from pathlib import Path

from defmanip_gym.baselines.learned.actor import (
    CARD_SUFFIX,
    TENSOR_SUFFIX,
    MlpActor,
    load_actor,
)
from defmanip_gym.errors import AgentFileError

_SHIPPED = Path(__file__).parent / "shipped"
RUN_AGENT = "agent"  # name of the exported agent in a run folder


def shipped_agents() -> tuple[str, ...]:
    """Return the names of the agents that come with the package."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob(f"*{TENSOR_SUFFIX}")))


def load_agent(name: str | Path) -> MlpActor:
    """Load a shipped agent by name, or any by its run folder, tensor file or card.

    Raises:
        AgentFileError: nothing there, or not an agent of this package.
    """
    if str(name) in shipped_agents():
        return load_actor(_SHIPPED / str(name))
    path = Path(name)
    if path.is_dir():
        return load_actor(path / RUN_AGENT)
    if path.is_file() and zipfile.is_zipfile(path):
        raise AgentFileError(
            "agent",
            str(path),
            "a run folder or a .safetensors file",
            "SB3 zip files run code when they are loaded, so they are not. Use the run folder "
            "that train.py made, or pass a model you loaded yourself: SB3 models are controllers.",
        )
    if path.suffix in (TENSOR_SUFFIX, CARD_SUFFIX):
        return load_actor(path.with_suffix(""))
    raise AgentFileError(
        "agent",
        str(name),
        f"a run folder, a .safetensors file, or a shipped agent: {', '.join(shipped_agents())}",
        "Check the name or path.",
    )
