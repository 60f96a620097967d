"""What names a line of results: who ran in which suite."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Family = Literal["reference", "analytic", "learned", "guest"]

SOLE_MEMBER = "-"  # of contestants that nobody trains


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A member of a contestant in a suite.

    Attributes:
        suite: name.
        contestant: name.
        family: what kind of controller it is.
        member: seed of its training, or ``SOLE_MEMBER``.
    """

    suite: str
    contestant: str
    family: Family
    member: str = SOLE_MEMBER

    @property
    def file_stem(self) -> str:
        """Its name in file names: slashes become pluses, colons equal signs."""
        return f"{self.contestant.replace('/', '+').replace(':', '=')}.{self.member}"
