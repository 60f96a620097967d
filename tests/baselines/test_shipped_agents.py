"""Shipped agents do what their cards say."""

import pytest

from defmanip_gym.baselines.learned.agents import load_agent, shipped_agents
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.scenarios import comparison_scenarios


@pytest.mark.parametrize("name", shipped_agents())
def test_shipped_agent_reaches_the_goal_from_unseen_starts(name):
    records = []
    rollout(
        name,
        load_agent(name),
        comparison_scenarios(41)[1:],
        config=TransportConfig(constraint_mode="cost"),
        horizon_s=20.0,
        on_finished=lambda record, _: records.append(record),
        on_step=lambda: None,
    )
    assert len(records) == 40
    assert sum(record.success for record in records) >= 0.8 * 40


@pytest.mark.parametrize("name", shipped_agents())
def test_card_records_how_the_agent_was_made(name):
    card = load_agent(name).card
    assert card.command == f"python train.py --algo {card.algorithm} --seed {card.seed}"
    assert card.git_revision not in ("unknown", "") and "dirty" not in card.git_revision
    assert card.total_timesteps > 0


def test_an_agent_is_shipped():
    assert "ppo-deform-transport-v0" in shipped_agents()
