"""Families of agents on disk: one recipe, trained with several seeds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from defmanip_gym.baselines.learned.actor import TENSOR_SUFFIX, MlpActor, card_path, load_actor
from defmanip_gym.baselines.learned.card import AgentCard
from defmanip_gym.errors import AgentFileError
from defmanip_gym.files import write_atomically

SHIPPED = Path(__file__).parent / "shipped"
_MEMBER = re.compile(rf"seed-(0|[1-9][0-9]*){re.escape(TENSOR_SUFFIX)}")
_ALIKE = (
    "env_id",
    "algorithm",
    "recipe",
    "hyperparameters",
    "certificate",
    "safety_filter",
    "filter_specification",
    "residual_authority_m_s2",
    "residual_base",
    "sources",
)


def member_name(seed: int) -> str:
    """Return the file name, without suffix, of a family's member."""
    return f"seed-{seed}"


def family_seeds(name: str, library: Path = SHIPPED) -> tuple[int, ...]:
    """Return the seeds of a family's members, in order; none if there is no such family."""
    matches = (_MEMBER.fullmatch(path.name) for path in (library / name).glob("*"))
    return tuple(sorted(int(match[1]) for match in matches if match))


def shipped_families(library: Path = SHIPPED) -> tuple[str, ...]:
    """Return the names of the families that have members.

    Args:
        library: folder of families, the package's own by default.
    """
    if not library.is_dir():
        return ()
    names = sorted(path.name for path in library.iterdir() if path.is_dir())
    return tuple(name for name in names if family_seeds(name, library))


def load_family(name: str, library: Path = SHIPPED) -> tuple[MlpActor, ...]:
    """Load all members of a family, sorted by seed.

    Args:
        name: of the family.
        library: folder of families, the package's own by default.

    Raises:
        AgentFileError: no such family, no members, or members that do not belong together.
    """
    families = shipped_families(library)
    if name not in families:
        listed = ", ".join(families) or f"none, {library} has no families with members"
        raise AgentFileError("family", name, listed, "Check the name.")
    folder, seeds = library / name, family_seeds(name, library)
    members = tuple(load_actor(folder / member_name(seed)) for seed in seeds)
    for member, seed in zip(members, seeds, strict=True):
        if member.card.seed != seed:
            raise AgentFileError(
                f"seed of {folder / member_name(seed)}",
                member.card.seed,
                f"{seed}, as in the file's name",
                "Rename both files.",
            )
    require_alike(members, folder)
    return members


def load_member(family: str, member: str | None, library: Path = SHIPPED) -> MlpActor:
    """Load one agent of a family: ``"seed-3"``, or by None the one of the lowest seed.

    Raises:
        AgentFileError: there is no such agent, or it is damaged.
    """
    names = [member_name(seed) for seed in family_seeds(family, library)]
    chosen = names[0] if member is None and names else member
    if chosen not in names:
        listed = ", ".join(names) or f"a member of {', '.join(shipped_families(library))}"
        raise AgentFileError(f"member of {family}", member, listed, "Check the name.")
    return load_actor(library / family / chosen)


def write_card(family: str, card: AgentCard, library: Path = SHIPPED) -> None:
    """Replace the card of the family's member that has its seed.

    Raises:
        AgentFileError: the library cannot be written.
    """
    path = card_path(library / family / member_name(card.seed))
    try:
        write_atomically(path, card.to_text().encode())
    except OSError as error:
        raise AgentFileError(
            "agent card", str(path), "a file that can be written", f"{error}."
        ) from error


def require_alike(members: Sequence[MlpActor], folder: Path) -> None:
    """Raise AgentFileError unless cards differ by seed and revision only."""
    for name in _ALIKE:
        values = {str(getattr(member.card, name)) for member in members}
        if len(values) > 1:
            raise AgentFileError(
                f"{name} of the agents in {folder}",
                sorted(values),
                "the same for all of them",
                "Make a family of its own for each.",
            )
