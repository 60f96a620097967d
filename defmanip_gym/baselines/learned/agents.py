"""Finding agents, shipped ones by name and others by path, and making controllers of them."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.learned.actor import CARD_SUFFIX, TENSOR_SUFFIX, MlpActor, load_actor
from defmanip_gym.baselines.learned.deployment import deployed
from defmanip_gym.baselines.learned.families import (
    SHIPPED,
    load_family,
    load_member,
    shipped_families,
)
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.errors import AgentFileError

__all__ = [
    "RUN_AGENT",
    "is_sb3_zip",
    "load_agent",
    "load_controller",
    "load_family",
    "shipped_families",
]

RUN_AGENT = "agent"  # name of the exported agent in a run folder


def load_agent(name: str | Path, library: Path = SHIPPED) -> MlpActor:
    """Load a shipped agent by name, or any by its run folder, tensor file or card.

    ``"ppo/seed-3"`` is that member of a shipped family and ``"ppo"`` the one of the lowest seed:
    the best of several would promise more than another training keeps. A shipped name goes before
    a file of that name. SB3's zip files are refused, see :func:`load_controller`.

    Args:
        name: name or path.
        library: folder of families, the package's own by default.

    Raises:
        AgentFileError: nothing there, or not an agent of this package.
    """
    if not isinstance(name, str | Path):
        raise AgentFileError("agent", name, "a name or a path", "See defmanip agents.")
    text = name.as_posix() if isinstance(name, Path) else name
    family, _, member = text.partition("/")
    families = shipped_families(library)
    if family in families:
        return load_member(family, member or None, library)
    path = Path(name)
    if os.path.isdir(path):  # unlike Path's method this answers whatever the name
        return load_actor(path / RUN_AGENT)
    if is_sb3_zip(path):
        raise AgentFileError(
            "agent",
            str(path),
            "a run folder or a .safetensors file",
            "SB3's zip files run code of whoever made them when they are loaded. If you trust "
            "them, pass --allow-pickle to evaluate.py (allow_pickle=True to load_controller). "
            "train.py's run folders hold agents without code.",
        )
    for suffix in (TENSOR_SUFFIX, CARD_SUFFIX):
        if path.name.endswith(suffix):
            return load_actor(path.with_name(path.name.removesuffix(suffix)))
    raise AgentFileError(
        "agent",
        str(name),
        f"a run folder, a .safetensors file, or a shipped agent: {', '.join(families)}",
        "Check the name or path.",
    )


def load_controller(
    name: str | Path, *, allow_pickle: bool = False, normalization: str | None = None
) -> Controller:
    """Load an agent as the controller it stands for, inside the filter it learned in, if any.

    Args:
        name: as for :func:`load_agent`.
        allow_pickle: take SB3's zip files, too, which run whatever code their maker put in.
        normalization: of a zip file, as for :func:`~.sb3_zip.load_sb3_zip`.

    Raises:
        AgentFileError: nothing there, not an agent, or a zip file that is not allowed.
    """
    path = Path(name)
    if allow_pickle and is_sb3_zip(path):
        return load_sb3_zip(path, normalization)
    return deployed(load_agent(name))


def is_sb3_zip(path: Path) -> bool:
    """Whether a path is a zip file, which only SB3 could load."""
    return os.path.isfile(path) and zipfile.is_zipfile(path)
