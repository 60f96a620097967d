"""What a return is worth: the mean returns of a random policy and of an expert.

Minari's ``get_normalized_score`` puts a return between the two. They belong to the task: each runs
on the inner loop that it is made for, from starts of its own, the same for every dataset.
"""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.datasets.collection import environment, episodes_of
from defmanip_gym.datasets.mixture import Part
from defmanip_gym.envs.config import ConstraintMode
from defmanip_gym.evaluation.contestants import standard_contestants
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.evaluation.seeds import FIRST_REFERENCE_SEED

WORST, BEST = "random", "field"
REFERENCE_EPISODES = 32


@dataclass(frozen=True, kw_only=True)
class ReferenceScores:
    """Mean undiscounted returns.

    Attributes:
        worst: of uniform actions.
        best: of the best controller that plans nothing beforehand.
    """

    worst: float
    best: float


def reference_scores(env_id: str, constraint_mode: ConstraintMode) -> ReferenceScores:
    """Return the reference scores of an environment; takes seconds."""
    means = {}
    for contestant in standard_contestants((WORST, BEST), Certificates()):
        seeds = tuple(FIRST_REFERENCE_SEED + index for index in range(REFERENCE_EPISODES))
        part = Part(contestant=contestant, member=contestant.members[0], seeds=seeds)
        env = environment(env_id, contestant.inner_loop, constraint_mode)
        returns = [
            float(course.reward.sum()) for batch in episodes_of(part, env) for course in batch
        ]
        env.close()
        means[contestant.name] = sum(returns) / len(returns)
    return ReferenceScores(worst=means[WORST], best=means[BEST])
