"""Zip files of SB3 in a comparison: only where allowed, and then like every other agent."""

from __future__ import annotations

import json
import pickle
import shlex
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import tyro
from sb3_models import Spaces, poisoned, saved

from defmanip_gym.errors import AgentFileError
from defmanip_gym.evaluation import comparison, suites
from defmanip_gym.evaluation.comparison import ComparisonConfig, run_comparison
from defmanip_gym.evaluation.learned_contestants import agent_contestants
from defmanip_gym.evaluation.protection import Certificates

OBSERVATIONS = np.random.default_rng(0).normal(size=(5, 22))


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Episodes of a fifth of a second, and no outputs."""
    brief = tuple(replace(suite, horizon_s=0.2) for suite in suites.SUITES)
    monkeypatch.setattr(suites, "SUITES", brief)
    monkeypatch.setattr(comparison, "print_results", lambda *_: None)
    monkeypatch.setattr(comparison, "write_outputs", lambda *_: ((), None))


def config(folder, path, **changes):
    settings = {
        "output": folder / "out",
        "suites": ("nominal",),
        "episodes": 2,
        "contestants": (),
        "agents": (path,),
        "allow_pickle": True,
        "jobs": 1,
    }
    return ComparisonConfig(**(settings | changes))


def rows(folder):
    """Return every record of a comparison by contestant and scenario."""
    lines = [
        json.loads(line)
        for path in (folder / "records").rglob("*.jsonl")
        for line in path.read_text().splitlines()[1:]
    ]
    return {(row["contestant"], row["scenario"]): row for row in lines}


def test_a_strangers_zip_is_refused_without_running_anything(tmp_path):
    path, trace = tmp_path / "model.zip", tmp_path / "it-ran"
    poisoned(path, trace)
    with pytest.raises(AgentFileError, match="--allow-pickle"):
        run_comparison(config(tmp_path, path, allow_pickle=False))
    assert not trace.exists() and not (tmp_path / "out").exists()


def test_an_allowed_zip_runs_without_and_with_filter_in_any_process(tmp_path):
    path = tmp_path / "model.zip"
    saved(path)
    run_comparison(config(tmp_path, path))
    run_comparison(config(tmp_path, path, jobs=2, output=tmp_path / "parallel"))
    here, there = rows(tmp_path / "out"), rows(tmp_path / "parallel")
    assert len(here) == 4 and here == there
    names = {contestant for contestant, _ in here}
    assert {name.partition("@")[0] for name in names} == {"model"}
    assert {name.partition("/")[2] for name in names} == {"", "storage"}
    assert {row["family"] for row in here.values()} == {"learned"}


def test_it_acts_as_the_model_also_after_pickling(tmp_path):
    model = saved(tmp_path / "model.zip")
    expected = model.predict(OBSERVATIONS, deterministic=True)[0]
    contestants = agent_contestants(tmp_path / "model.zip", Certificates(), allow_pickle=True)
    for contestant in contestants:
        spec = pickle.loads(pickle.dumps(contestant)).members[0].controller
        acted = spec.build([1]).predict(OBSERVATIONS, deterministic=True)[0]
        assert acted == pytest.approx(expected)
        assert spec.identity == {"controller": spec.digest} and spec.digest in contestant.name


def test_a_model_for_other_observations_is_refused_before_anything_runs(tmp_path):
    path = tmp_path / "model.zip"
    saved(path, env=Spaces((24,)))
    with pytest.raises(AgentFileError, match=r"24.*22"):
        run_comparison(config(tmp_path, path))
    assert not (tmp_path / "out").exists()


def test_a_model_that_was_replaced_meanwhile_is_refused(tmp_path):
    path = tmp_path / "model.zip"
    saved(path)
    plain, _ = agent_contestants(path, Certificates(), allow_pickle=True)
    saved(path)
    with pytest.raises(AgentFileError, match="replaced"):
        plain.members[0].controller.build([1])


def test_the_command_names_the_permission(tmp_path):
    settings = ComparisonConfig(agents=(tmp_path / "model.zip",), allow_pickle=True)
    assert settings.command.endswith("model.zip --allow-pickle")
    assert tyro.cli(ComparisonConfig, args=shlex.split(settings.command)[2:]) == settings
