"""EnvPool's HalfCheetah as a candidate, if EnvPool is installed (``pip install -e '.[bench]'``)."""

from __future__ import annotations

import numpy as np

from turns import Candidate

NAME = "HalfCheetah-v5"
_DEGREES_OF_FREEDOM = 9


def envpool_cheetah(name: str, num_envs: int, num_threads: int) -> tuple[Candidate, int]:
    """Return the candidate, and substeps times degrees of freedom of one of its steps.

    Raises:
        ImportError: EnvPool is not installed.
    """
    import envpool

    env = envpool.make(NAME, env_type="gymnasium", num_envs=num_envs, num_threads=num_threads)
    env.reset()
    stored = np.random.default_rng(0).uniform(-1, 1, (64, num_envs, *env.action_space.shape))
    index = 0

    def step() -> None:
        nonlocal index
        env.step(stored[index])
        index = (index + 1) % len(stored)

    candidate = Candidate(name=name, num_envs=num_envs, step=step, close=env.close)
    return candidate, env.spec.config.frame_skip * _DEGREES_OF_FREEDOM
