"""Which seeds belong to what, so that no agent is judged on starts that it has trained on.

Training draws from [0, ``VALIDATION_SEED``), the evaluations and tuning during training from
[``VALIDATION_SEED``, ``FIRST_EVALUATION_SEED``), suites from ``FIRST_EVALUATION_SEED`` up,
reference scores of datasets from ``FIRST_REFERENCE_SEED``, datasets from ``FIRST_DATASET_SEED``.
"""

from __future__ import annotations

VALIDATION_SEED = 900_000
FIRST_EVALUATION_SEED = 1_000_000
FIRST_REFERENCE_SEED = 9_000_000
FIRST_DATASET_SEED = 10_000_000

LARGEST_BATCH = 4096
_PER_RUN = 1000

MOST_DATASET_EPISODES = 100_000
LARGEST_DATASET_SEED = 9_000  # beyond it the seeds of random policies would follow


def training_seed(run_seed: int, steps: int = 0) -> int:
    """Return the first of the seeds that a training batch starts with.

    Args:
        run_seed: of the training run.
        steps: environment steps done when the run goes on after an interruption.
    """
    return (run_seed * _PER_RUN + steps) % (VALIDATION_SEED - LARGEST_BATCH)


def dataset_seed(seed: int, episode: int = 0) -> int:
    """Return the seed of an episode of a dataset; no two datasets of different seeds share any.

    Args:
        seed: of the dataset, at most ``LARGEST_DATASET_SEED``.
        episode: its number, less than ``MOST_DATASET_EPISODES``.
    """
    return FIRST_DATASET_SEED + seed * MOST_DATASET_EPISODES + episode
