"""``defmanip agents``: read cards, print them, or write scores into them."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from defmanip_gym.baselines.learned.agents import load_agent, load_family, shipped_families
from defmanip_gym.baselines.learned.card import AgentCard
from defmanip_gym.baselines.learned.families import member_name
from defmanip_gym.catalogue.config import AgentsConfig
from defmanip_gym.catalogue.table import agents_table, card_table, scores_table
from defmanip_gym.errors import AgentFileError
from defmanip_gym.evaluation.agent_scores import scoring_commands, write_scores


def run_agents(config: AgentsConfig) -> None:
    """Print the agents' table, one agent's card, or which cards got scores.

    Raises:
        AgentFileError: an agent or library that is missing or damaged.
        RecordError: no records to take scores from.
    """
    console = Console()
    if config.score is not None:
        for name in write_scores(config.score, config.library):
            console.print(f"Scores written: {name}", highlight=False)
    elif config.name is not None:
        _show(config.name, config, console)
    else:
        cards = _cards(config)
        if config.json:
            _print_json([_content(name, card, config.library) for name, card in cards.items()])
        else:
            console.print(agents_table(cards))


def _cards(config: AgentsConfig) -> dict[str, AgentCard]:
    """Return the cards of all families by name; a library that is not there is no empty one."""
    if not os.path.isdir(config.library):
        raise AgentFileError(
            "library", str(config.library), "a folder of families", "Check the path."
        )
    return {
        f"{family}/{member_name(actor.card.seed)}": actor.card
        for family in shipped_families(config.library)
        for actor in load_family(family, config.library)
    }


def _show(name: str, config: AgentsConfig, console: Console) -> None:
    card = load_agent(name, config.library).card
    if config.json:
        _print_json(_content(name, card, config.library))
        return
    console.print(card_table(name, card))
    if card.scores:
        console.print(scores_table(card))
    # plain, so that no line break or markup gets into what is to be copied
    print(f"Train it again, at revision {card.git_revision}:", card.command, sep="\n  ")
    commands = scoring_commands(name, card, config.library)
    print("Measure its scores again:", *commands, sep="\n  ")


def _content(name: str, card: AgentCard, library: Path) -> dict[str, Any]:
    commands = scoring_commands(name, card, library)
    return {"name": name, **asdict(card), "scoring_commands": commands}


def _print_json(content: Any) -> None:
    print(json.dumps(content, indent=2, ensure_ascii=False))
