"""docs/training.md says what the code does."""

import re
from pathlib import Path

import optuna
import pytest
import yaml

from defmanip_gym.envs.registration import (
    ENV_ID,
    RANDOMIZED_DAMPING,
    RANDOMIZED_ENV_ID,
    RANDOMIZED_MASS_SHARES,
)
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED, VALIDATION_SEED
from defmanip_gym.training.config import ALGORITHM_OF
from defmanip_gym.training.hyperparameters import HYPERPARAMETERS, load_hyperparameters
from defmanip_gym.training.search_spaces import SEARCH_SPACES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "training.md").read_text()
STUDY = PAGE.split("A study of `ppo`")[1]


def test_every_recipe_has_its_row_with_its_algorithm():
    rows = dict(re.findall(r"^\| `(\w+)` \| (\w+)", PAGE, re.M))
    assert {name: algorithm.lower() for name, algorithm in rows.items()} == ALGORITHM_OF


def test_horizon_of_value_is_the_files():
    gamma = yaml.safe_load((HYPERPARAMETERS / "ppo.yml").read_text())[ENV_ID]["gamma"]
    told, seconds = re.search(r"γ = ([\d.]+), ([\d.]+) s", PAGE).groups()
    assert float(told) == gamma
    assert float(seconds) == pytest.approx(0.02 / (1 - gamma), abs=0.005)


def test_randomized_environment_and_seeds_are_as_told():
    low, high = RANDOMIZED_DAMPING
    assert RANDOMIZED_ENV_ID in PAGE and f"damping from {low} to {high}" in PAGE
    assert RANDOMIZED_MASS_SHARES == (0.8, 1.2) and "within ±20 %" in PAGE
    assert f"{VALIDATION_SEED:,}" in PAGE and f"{FIRST_EVALUATION_SEED:,}" in PAGE


def test_the_study_is_of_the_search_space_as_it_is():
    header, *trials = re.findall(r"^\| (\w+) \| ([\w.]+) \| (.*) \|$", STUDY, re.M)
    trial = optuna.create_study().ask()
    SEARCH_SPACES["ppo"](trial, load_hyperparameters(None, "ppo", ENV_ID))
    assert header[:2] == ("trial", "score") and header[2].split(" | ") == sorted(trial.params)
    assert sorted(int(number) for number, *_ in trials) == list(range(len(trials)))
    assert f"defmanip tune --trials {len(trials)} " in STUDY


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target
