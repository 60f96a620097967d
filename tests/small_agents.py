"""Small agents with random weights."""

from dataclasses import replace

import numpy as np

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.card import AgentCard

CARD = AgentCard(
    env_id="DeformTransport-v0",
    package_version="0.1.0",
    observation_size=22,
    action_size=3,
    activation="tanh",
    squashed=False,
    algorithm="ppo",
    recipe="ppo",
    hyperparameters={"n_envs": 2, "policy_kwargs": {"net_arch": [8]}},
    command="python train.py --algo ppo --seed 0",
    seed=0,
    total_timesteps=100,
    git_revision="0123456789ab",
)


def small_agent(**changes):
    card = replace(CARD, **changes)
    generator = np.random.default_rng(card.seed)
    sizes = (card.observation_size, 8, card.action_size)
    layers = list(zip(sizes[1:], sizes[:-1], strict=True))
    return MlpActor(
        card,
        weights=[generator.normal(size=shape) for shape in layers],
        biases=[generator.normal(size=rows) for rows, _ in layers],
        observation_mean=np.zeros(card.observation_size),
        observation_variance=np.ones(card.observation_size),
    )
