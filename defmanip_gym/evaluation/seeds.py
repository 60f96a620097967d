"""Which seeds belong to what, so that no agent is judged on starts that it has trained on.

Training draws from [0, ``VALIDATION_SEED``), the evaluations and tuning during training from
[``VALIDATION_SEED``, ``FIRST_EVALUATION_SEED``), and suites from ``FIRST_EVALUATION_SEED`` up.
"""

from __future__ import annotations

VALIDATION_SEED = 900_000
FIRST_EVALUATION_SEED = 1_000_000

LARGEST_BATCH = 4096
_PER_RUN = 1000


def training_seed(run_seed: int, steps: int = 0) -> int:
    """Return the first of the seeds that a training batch starts with.

    Args:
        run_seed: of the training run.
        steps: environment steps done when the run goes on after an interruption.
    """
    return (run_seed * _PER_RUN + steps) % (VALIDATION_SEED - LARGEST_BATCH)
