"""Shipped agents do what their cards say."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from defmanip_gym.baselines.learned.agents import (
    load_agent,
    load_family,
    shipped_families,
)
from defmanip_gym.baselines.learned.deployment import controller_of, deployed
from defmanip_gym.envs.registration import (
    ENV_ID,
    QUICK_ENV_ID,
    RANDOMIZED_ENV_ID,
    ROBUST_ENV_ID,
)
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

EPISODES, HORIZON_S = 40, 40.0
# masses at the ends of the randomized range are beyond most of what was learned so far
FLOORS = {ENV_ID: 0.8, RANDOMIZED_ENV_ID: 0.6, QUICK_ENV_ID: 0.98, ROBUST_ENV_ID: 0.9}


def successes(agent):
    """Run an agent from unseen starts, as it was trained, and count the episodes that succeed."""
    env = gymnasium.make_vec(
        f"defmanip_gym:{agent.card.env_id}",
        num_envs=EPISODES,
        max_episode_steps=round(HORIZON_S / 0.02),
        autoreset_mode=AutoresetMode.DISABLED,
    )
    certificate = None
    if agent.card.certificate is not None:
        certificate = certify(
            BeamParams(), method=agent.card.certificate, conditions=TRANSPORT_CONDITIONS
        )
        env = NuMaxVectorActionScaling(env, certificate)
    controller, state = controller_of(agent, certificate=certificate), None
    if agent.card.safety_filter is not None:
        controller = deployed(agent)
    observation, _ = env.reset(seed=FIRST_EVALUATION_SEED)
    running, succeeded = np.ones(EPISODES, dtype=bool), np.zeros(EPISODES, dtype=bool)
    while running.any():
        action, state = controller.predict(observation, state, deterministic=True)
        observation, _, terminated, truncated, info = env.step(
            np.where(running[:, None], action, 0.0)
        )
        succeeded |= running & terminated & info["is_success"]
        running &= ~(terminated | truncated)
    env.close()
    return int(succeeded.sum())


@pytest.mark.parametrize("family", shipped_families())
def test_shipped_agent_reaches_the_goal_from_unseen_starts(family):
    agent = load_agent(family)
    assert successes(agent) >= FLOORS[agent.card.env_id] * EPISODES


@pytest.mark.parametrize("family", shipped_families())
def test_cards_record_how_the_agents_were_made(family):
    for agent in load_family(family):
        card = agent.card
        assert card.command.startswith(f"python train.py --algo {card.recipe}")
        assert card.command.endswith(f"--seed {card.seed}")
        assert card.git_revision not in ("unknown", "") and "dirty" not in card.git_revision
        assert card.total_timesteps > 0 and card.hyperparameters["n_envs"] > 0


def test_an_agent_is_shipped():
    assert "ppo" in shipped_families()
