"""Shipping takes finished runs of committed sources, and all of them or none."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import get_args

import pytest
import tyro
from small_agents import small_agent

from defmanip_gym.baselines.learned.agents import load_family, shipped_families
from defmanip_gym.cli import main
from defmanip_gym.envs.registration import (
    ENV_ID,
    QUICK_ENV_ID,
    RANDOMIZED_ENV_ID,
    ROBUST_ENV_ID,
)
from defmanip_gym.errors import AgentFileError, RunFolderError
from defmanip_gym.training.config import Recipe, TrainConfig
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.ship_config import ShipConfig
from defmanip_gym.training.shipping import ship
from defmanip_gym.training.trainings_config import TrainingsConfig

ROOT = Path(__file__).parents[2]


@pytest.fixture
def run(tmp_path):
    """Make run folders as training leaves them."""

    def make(seed=0, *, steps=100, inside=None, **changes):
        inside = inside or {}
        path = tmp_path / "runs" / f"{len(list(tmp_path.glob('runs/*')))}"
        small_agent(seed=seed, total_timesteps=40, **changes).save(path / "agent")
        small_agent(seed=seed, total_timesteps=steps, **changes).save(path / "last")
        content = {
            "train": asdict(TrainConfig(**inside)),
            "hyperparameters": load_hyperparameters(None, "ppo", ENV_ID) | {"n_timesteps": 100},
            "command": "python train.py",
            "package_version": "0.1.0",
            "git_revision": "0123456789ab",
            "sources": "0123456789abcdef",
        }
        (path / "config.json").write_text(json.dumps(content, default=str))
        return path

    return make


@pytest.fixture
def library(tmp_path):
    return tmp_path / "library"


def test_the_best_agents_of_runs_become_families(run, library):
    runs = (
        run(0),
        run(3),
        run(1, env_id="DeformTransportRandomized-v0"),
        run(2, inside={"certificate": "l1"}),
        run(4, inside={"filter": "storage"}),
    )
    names = (
        "ppo/seed-0",
        "ppo/seed-3",
        "ppo-randomized/seed-1",
        "ppo-l1/seed-2",
        "ppo-storage/seed-4",
    )
    assert ship(ShipConfig(runs=runs, library=library)) == names
    assert shipped_families(library) == ("ppo", "ppo-l1", "ppo-randomized", "ppo-storage")
    assert [agent.card.seed for agent in load_family("ppo", library)] == [0, 3]
    for name, path in zip(names, runs, strict=True):
        for suffix in (".json", ".safetensors"):
            original = (path / f"agent{suffix}").read_bytes()
            assert (library / f"{name}{suffix}").read_bytes() == original


def test_an_earlier_agent_is_replaced(run, library):
    ship(ShipConfig(runs=(run(0),), library=library))
    ship(ShipConfig(runs=(run(0, recipe="ppo", command="python train.py again"),), library=library))
    (agent,) = load_family("ppo", library)
    assert agent.card.command == "python train.py again"


@pytest.mark.parametrize(
    ("bad", "error", "said"),
    [
        ({"steps": 99}, RunFolderError, "--resume"),
        ({"git_revision": "0123456789ab-dirty"}, RunFolderError, "commit"),
        ({"git_revision": "unknown"}, RunFolderError, "commit"),
        ({"seed": 0}, RunFolderError, "one run for ppo/seed-0"),
        ({"hyperparameters": {"n_envs": 3}}, AgentFileError, "hyperparameters"),
    ],
)
def test_one_bad_run_and_nothing_is_shipped(run, library, bad, error, said):
    runs = (run(0), run(**({"seed": 1} | bad)))
    with pytest.raises(error, match=said):
        ship(ShipConfig(runs=runs, library=library))
    assert not library.exists()


def test_a_library_that_is_a_file_is_refused(run, library):
    library.touch()
    with pytest.raises(RunFolderError, match="a file that can be written"):
        ship(ShipConfig(runs=(run(0),), library=library))


def test_new_agents_must_go_with_those_that_stay(run, library):
    ship(ShipConfig(runs=(run(0),), library=library))
    for name, value in {"hyperparameters": {"n_envs": 3}, "sources": "another"}.items():
        other = run(1, **{name: value})
        with pytest.raises(AgentFileError, match=name):
            ship(ShipConfig(runs=(other,), library=library))
    assert [agent.card.seed for agent in load_family("ppo", library)] == [0]


def test_a_run_without_agent_and_no_run_at_all_are_refused(run, library, tmp_path):
    path = run(0)
    (path / "last.json").unlink()
    with pytest.raises(AgentFileError, match="last"):
        ship(ShipConfig(runs=(path,), library=library))
    with pytest.raises(RunFolderError, match="train.py"):
        ship(ShipConfig(runs=(tmp_path,), library=library))
    with pytest.raises(RunFolderError, match="at least one"):
        ShipConfig(runs=(), library=library)


def test_a_run_with_a_damaged_configuration_is_refused(run, library):
    path = run(0) / "config.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"train": {}}))
    with pytest.raises(RunFolderError, match="train"):
        ship(ShipConfig(runs=(path.parent,), library=library))


def test_the_command_says_what_it_shipped(run, library, monkeypatch, capsys):
    words = ["defmanip", "ship", str(run(0)), str(run(1)), "--library", str(library)]
    monkeypatch.setattr(sys, "argv", words)
    main()
    assert capsys.readouterr().out == "Shipped: ppo/seed-0\nShipped: ppo/seed-1\n"


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_make_agents_trains_and_ships_every_recipe_with_five_seeds():
    answer = subprocess.run(
        ["make", "--always-make", "--dry-run", "agents"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    commands = [shlex.split(line) for line in answer.stdout.splitlines() if "defmanip" in line]
    assert commands[-1][1:] == ["ship", "runs/*"] and commands[-2][1] == "trainings"
    trainings = [tyro.cli(TrainingsConfig, args=words[2:]) for words in commands[:-1]]
    runs = [(run.algo, run.env_id, run.seed) for config in trainings for run in config.runs]
    expected = {(recipe, ENV_ID, seed) for recipe in get_args(Recipe) for seed in range(5)}
    for env_id in (RANDOMIZED_ENV_ID, QUICK_ENV_ID, ROBUST_ENV_ID):
        expected |= {("ppo", env_id, seed) for seed in range(5)}
    expected |= {("sac", QUICK_ENV_ID, seed) for seed in range(5)}
    assert set(runs) == expected and len(runs) == len(expected)
