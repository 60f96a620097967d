"""Who controls which episodes of a dataset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.options import OTHER_INNER_LOOP
from defmanip_gym.evaluation.seeds import dataset_seed


@dataclass(frozen=True, kw_only=True)
class Part:
    """The episodes of one member of a contestant.

    Attributes:
        contestant: it is one of.
        member: who controls.
        seeds: of the episodes.
    """

    contestant: Contestant
    member: Member
    seeds: tuple[int, ...]


def parts_of(
    contestants: Sequence[Contestant], shares: Sequence[float], episodes: int, seed: int
) -> tuple[Part, ...]:
    """Return the parts of a dataset, contestant by contestant, members in their order.

    Args:
        contestants: at least one.
        shares: of the episodes, one for each, > 0; they need not sum to one.
        episodes: in all.
        seed: of the dataset.

    Raises:
        ParameterError: too few episodes for everybody to have one.
    """
    parts, first = [], 0
    for contestant, count in zip(contestants, _counts(shares, episodes), strict=True):
        members = contestant.members
        if count < len(members):
            raise ParameterError(
                "episodes",
                episodes,
                f"enough for each of the {len(members)} members of {contestant.name}, "
                f"whose share is {count}",
                "Ask for more episodes, or fewer --members.",
            )
        for index, member in enumerate(members):
            numbers = range(first + index, first + count, len(members))
            seeds = tuple(dataset_seed(seed, number) for number in numbers)
            parts.append(Part(contestant=contestant, member=member, seeds=seeds))
        first += count
    return tuple(parts)


def common_inner_loop(contestants: Sequence[Contestant]) -> InnerLoopKind:
    """Return the inner loop that all contestants run on: a dataset has one environment.

    References, which ask for nothing or for anything, run on the others'.

    Raises:
        ParameterError: some are made for one inner loop and some for the other.
    """
    kinds = {c.name: c.inner_loop for c in contestants if c.family != "reference"}
    if len(set(kinds.values())) > 1:
        listed = ", ".join(f"{name} on {kind!r}" for name, kind in kinds.items())
        raise ParameterError(
            "contestants",
            listed,
            "contestants on one inner loop, since a dataset has one environment",
            f"Agents run on the other one, too: sac{OTHER_INNER_LOOP}.",
        )
    return next(iter(kinds.values()), "model")


def _counts(shares: Sequence[float], episodes: int) -> list[int]:
    """Return whole numbers in proportion to shares, the largest remainders rounded up."""
    exact = episodes * np.array(shares, dtype=float) / sum(shares)
    counts = np.floor(exact).astype(int)
    spare = episodes - int(counts.sum())
    counts[np.argsort(counts - exact, kind="stable")[:spare]] += 1
    return [int(count) for count in counts]
