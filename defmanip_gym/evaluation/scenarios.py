"""The starts that every contestant of a comparison gets: the paper's and sampled ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defmanip_gym.envs.starts import PAPER_START, StartSampler
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED
from defmanip_gym.params import StartParams
from defmanip_gym.validation import require_whole

PAPER_SCENARIO = "paper"


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """One start, the same for every contestant.

    Attributes:
        name: unique within a comparison.
        seed: of the episode's own randomness (sensor noise).
        start: (x, y, θ, q1, q2, φ), m and rad.
    """

    name: str
    seed: int
    start: tuple[float, ...]


def comparison_scenarios(count: int) -> tuple[Scenario, ...]:
    """Return the paper's start and ``count - 1`` sampled ones, always the same.

    A smaller count gives the first of a larger one.

    Raises:
        ParameterError: count below one.
    """
    require_whole("episodes", count, 1)
    paper = Scenario(name=PAPER_SCENARIO, seed=FIRST_EVALUATION_SEED, start=PAPER_START)
    return (paper, *(_sampled(index) for index in range(1, count)))


def _sampled(index: int) -> Scenario:
    seed = FIRST_EVALUATION_SEED + index
    sampler = StartSampler(StartParams(), [np.random.default_rng(seed)])
    start = sampler.sample(np.arange(1))[0]
    return Scenario(name=f"sampled-{index:02d}", seed=seed, start=tuple(start.tolist()))
