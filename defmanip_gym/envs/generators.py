"""The random generators of n episodes, one for each: what Gymnasium calls ``np_random``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from defmanip_gym.errors import SeedError, StateError
from defmanip_gym.validation import require_seed

UNKNOWN_SEED = -1  # Gymnasium's word for a generator that a user made
_STREAMS = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")


class EpisodeGenerators(Sequence[np.random.Generator]):
    """n generators and the seeds that they were made of.

    Args:
        count: n; each begins with a seed of its own that nobody chose.
    """

    def __init__(self, count: int) -> None:
        made = [seeding.np_random() for _ in range(count)]
        self._generators = [generator for generator, _ in made]
        self._seeds = [seed for _, seed in made]

    def __getitem__(self, index: Any) -> Any:
        return self._generators[index]

    def __len__(self) -> int:
        return len(self._generators)

    def __iter__(self) -> Iterator[np.random.Generator]:
        return iter(self._generators)

    @property
    def seeds(self) -> tuple[int, ...]:
        """What the generators were made of; -1 where a user has put one of his own."""
        return tuple(self._seeds)

    def seed(self, ids: Sequence[int], seeds: Sequence[int | None]) -> list[int]:
        """Make generators anew, where a seed is given, and return which.

        Args:
            ids: the episodes.
            seeds: one for each of them, or None to go on as it is.

        Raises:
            SeedError: a seed that is none; then nothing has changed.
        """
        made = {
            index: seeding.np_random(require_seed(seed))
            for index, seed in zip(ids, seeds, strict=True)
            if seed is not None
        }
        for index, (generator, seed) in made.items():
            self._generators[index], self._seeds[index] = generator, seed
        return list(made)

    def replace(self, generators: Sequence[np.random.Generator]) -> None:
        """Draw from a user's generators from now on.

        Raises:
            SeedError: no generators, or another number of them.
        """
        given = list(generators) if isinstance(generators, Sequence) else [generators]
        if len(given) != len(self) or not all(isinstance(g, np.random.Generator) for g in given):
            allowed = f"{len(self)} of NumPy's Generators" if len(self) > 1 else "NumPy's Generator"
            raise SeedError("np_random", generators, allowed, "Make them by np.random.default_rng.")
        if len({id(generator.bit_generator) for generator in given}) < len(given):
            raise SeedError(
                "np_random",
                generators,
                "a generator of its own for each episode",
                "Make them by np.random.default_rng, or by spawn of one.",
            )
        self._generators, self._seeds = given, [UNKNOWN_SEED] * len(given)

    def get_state(self) -> dict[str, Any]:
        """Return where the generators stand."""
        streams = [generator.bit_generator.state for generator in self._generators]
        return {"seeds": list(self._seeds), "streams": streams}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned; of a single one, all of them.

        Raises:
            StateError: it is not of so many generators of NumPy's; then nothing has changed.
        """
        try:
            seeds, streams = [int(seed) for seed in state["seeds"]], list(state["streams"])
            if len(seeds) == len(streams) == 1:
                seeds, streams = seeds * len(self), streams * len(self)
            if not len(seeds) == len(streams) == len(self):
                raise ValueError(f"of {len(streams)} generators")
            generators = [_generator(stream) for stream in streams]
        except (TypeError, ValueError, LookupError, AttributeError) as error:
            raise StateError(
                "generators", str(error), f"the states of {len(self)} generators", "See get_state."
            ) from error
        self._generators, self._seeds = generators, seeds


def _generator(stream: dict[str, Any]) -> np.random.Generator:
    kind = stream["bit_generator"]
    if kind not in _STREAMS:
        raise ValueError(f"a generator of kind {kind!r}")
    bits: Any = getattr(np.random, kind)(0)
    bits.state = stream
    return np.random.Generator(bits)
