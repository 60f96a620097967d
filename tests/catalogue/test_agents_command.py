"""``defmanip agents``: what it lists, shows and refuses."""

import json
import shutil
import sys
from dataclasses import replace

import pytest

from defmanip_gym.baselines.learned.agents import load_agent, shipped_families
from defmanip_gym.baselines.learned.card import SuiteScore
from defmanip_gym.baselines.learned.families import SHIPPED, write_card
from defmanip_gym.cli import main


@pytest.fixture
def library(tmp_path):
    """The first shipped PPO agent alone, with scores."""
    folder = tmp_path / "library"
    (folder / "ppo").mkdir(parents=True)
    for path in (SHIPPED / "ppo").glob("seed-0.*"):
        shutil.copy(path, folder / "ppo")
    card = load_agent("ppo").card
    score = SuiteScore(
        success_rate=0.96875,
        violation_rate=0.03125,
        score_iqm=0.6121,
        median_time_s=8.4,
        episodes=64,
    )
    write_card("ppo", replace(card, scores={"nominal": score}), folder)
    return folder


@pytest.fixture
def answer(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "120")

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["defmanip", "agents", *map(str, words)])
        main()
        return capsys.readouterr().out

    return run


def test_the_shipped_agents_are_listed(answer):
    printed = answer()
    assert "ppo/seed-0" in printed and "ppo/seed-4" in printed
    assert f"{load_agent('ppo').card.total_timesteps / 1e6:.2f} M" in printed


def test_the_list_fits_a_narrow_terminal(answer, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert "…" not in answer()


def test_listed_success_has_its_wilson_interval(answer, library):
    (row,) = [line for line in answer("--library", library).splitlines() if "ppo/seed-0" in line]
    assert "97 (89–99)" in row and "0.612" in row


def test_a_card_is_shown_with_the_commands_that_repeat_it(answer, library):
    printed = answer("ppo/seed-0", "--library", library)
    card = load_agent("ppo").card
    for part in (
        "learning_rate",
        card.hyperparameters["learning_rate"],
        card.git_revision,
        "97 (89–99)",
        f"{card.command}\n",
        f"python evaluate.py --output results/agents --suites nominal --episodes all --contestants "
        f"tanner --members all --agents {library}/ppo/seed-0.safetensors\n",
    ):
        assert part in printed


def test_a_shipped_agents_commands_measure_its_whole_family_and_write_its_scores(answer):
    printed = answer("ppo/seed-3")
    assert "--contestants ppo --members all\n" in printed
    assert "defmanip agents --score results/agents\n" in printed


def test_json_is_the_cards(answer, library):
    (listed,) = json.loads(answer("--json", "--library", library))
    assert listed["name"] == "ppo/seed-0"
    assert listed["scores"]["nominal"]["episodes"] == 64
    shown = json.loads(answer("ppo", "--json", "--library", library))
    assert shown | {"name": "ppo/seed-0"} == listed


def test_an_agent_of_ones_own_is_shown_by_its_path(answer, library):
    assert "git_revision" in answer(library / "ppo" / "seed-0.safetensors")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nobody"], f"shipped agent: {', '.join(shipped_families())}"),
        (["ppo/seed-99"], "seed-0"),
        (["--score", "nowhere"], "evaluate.py"),
        (["ppo", "--score", "nowhere"], "without a name"),
        (["--score", "nowhere", "--library", "nowhere"], "evaluate.py"),
        (["--library", "nowhere"], "a folder of families"),
    ],
)
def test_wrong_input_gets_a_message(words, said, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["defmanip", "agents", *words])
    with pytest.raises(SystemExit) as exit_info:
        main()
    assert exit_info.value.code == 2
    assert said in " ".join(capsys.readouterr().err.split())
