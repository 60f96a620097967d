from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from filelock import FileLock

from defmanip_gym.baselines.controller import RandomController
from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.errors import CertificateError, ParameterError, RecordError
from defmanip_gym.evaluation import comparison, outputs
from defmanip_gym.evaluation.comparison import ComparisonConfig, run_comparison
from defmanip_gym.evaluation.contestants import (
    RandomPerEpisode,
    agent_contestants,
    default_contestants,
)
from defmanip_gym.evaluation.store import RecordStore
from defmanip_gym.params import BeamParams


def config(folder, **changes):
    settings = {
        "output": folder / "out",
        "episodes": 3,
        "horizon_s": 0.2,
        "contestants": ("zero", "tanner/none"),
    }
    return ComparisonConfig(**(settings | changes))


@pytest.fixture(autouse=True)
def without_plots(monkeypatch):
    """Plots have their own tests and take seconds."""
    monkeypatch.setattr(outputs, "PLOTS", ())


@pytest.fixture
def started(monkeypatch):
    """Names of contestant and scenario of every episode that was started."""
    names = []

    def counting(contestant, controller, scenarios, **arguments):
        names.extend((contestant, scenario.name) for scenario in scenarios)
        original(contestant, controller, scenarios, **arguments)

    original = comparison.rollout
    monkeypatch.setattr(comparison, "rollout", counting)
    return names


def interrupt_at(monkeypatch, count):
    original, calls = RecordStore.add, []

    def add(self, record):
        calls.append(record)
        if len(calls) == count:
            raise KeyboardInterrupt
        original(self, record)

    monkeypatch.setattr(RecordStore, "add", add)


def test_a_finished_comparison_is_not_run_again(tmp_path, started, capsys):
    report = run_comparison(config(tmp_path))
    assert len(started) == 6
    report.unlink()
    started.clear()
    assert run_comparison(config(tmp_path)) == report
    assert started == [] and report.exists()
    assert "Success" in capsys.readouterr().out


def test_an_interrupted_comparison_goes_on_without_repeating(
    tmp_path, started, monkeypatch, capsys
):
    with monkeypatch.context() as patch:
        interrupt_at(patch, 5)
        with pytest.raises(SystemExit) as stop:
            run_comparison(config(tmp_path))
    assert stop.value.code == 130
    assert "running the same command again" in capsys.readouterr().out
    started.clear()
    run_comparison(config(tmp_path))
    assert [name for name, _ in started] == ["tanner/none"] * 2
    uninterrupted = config(tmp_path, output=tmp_path / "reference")
    run_comparison(uninterrupted)
    assert records(tmp_path / "out") == records(tmp_path / "reference")


def records(folder):
    lines = (folder / "records.jsonl").read_text().splitlines()
    return sorted(lines)


def test_contestants_can_join_later(tmp_path, started):
    run_comparison(config(tmp_path, contestants=("zero",)))
    started.clear()
    run_comparison(config(tmp_path))
    assert {name for name, _ in started} == {"tanner/none"}


def test_other_settings_need_another_folder_or_fresh(tmp_path, started):
    run_comparison(config(tmp_path))
    with pytest.raises(RecordError, match="--fresh"):
        run_comparison(config(tmp_path, damping=0.2))
    started.clear()
    run_comparison(config(tmp_path, damping=0.2, fresh=True))
    assert len(started) == 6


def test_bad_settings_are_refused(tmp_path):
    with pytest.raises(ParameterError, match="'tanner/l1'"):
        run_comparison(config(tmp_path, contestants=("tanner/l2",)))
    with pytest.raises(ParameterError, match="episodes"):
        config(tmp_path, episodes=0)
    with pytest.raises(ParameterError, match="horizon_s"):
        config(tmp_path, horizon_s=float("nan"))
    with pytest.raises(CertificateError):
        run_comparison(config(tmp_path, damping=0.0))


def test_an_output_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(RecordError, match="a folder that can be written"):
        run_comparison(config(tmp_path))


def test_command_repeats_the_settings(tmp_path):
    command = ComparisonConfig(episodes=20, contestants=("zero", "ppo"), fresh=True).command
    assert command == "python evaluate.py --episodes 20 --contestants zero ppo"


def test_contestants_have_their_own_names_and_colours():
    contestants = default_contestants(BeamParams(), 0.5)
    assert [contestant.name for contestant in contestants] == [
        "zero",
        "random",
        "tanner/tanner",
        "tanner/l1",
        "tanner/none",
        "ppo",
        "ppo/l1",
    ]
    assert len({contestant.colour for contestant in contestants}) == len(contestants)
    for contestant in contestants:
        assert (contestant.certificate is not None) == (
            "/" in contestant.name and not contestant.name.endswith("none")
        )


def test_random_actions_belong_to_the_episode():
    both = RandomPerEpisode([5, 6]).predict(np.zeros((2, 19)))[0]
    alone = RandomPerEpisode([6]).predict(np.zeros((1, 19)))[0]
    np.testing.assert_array_equal(both[1], alone[0])
    # not the numbers that sampled the start of the same seed
    assert not np.array_equal(alone[0], RandomController(6).predict(np.zeros(19))[0])


def test_a_second_comparison_in_the_same_folder_is_refused(tmp_path):
    settings = config(tmp_path)
    settings.output.mkdir(parents=True, exist_ok=True)
    with FileLock(settings.output / ".lock"), pytest.raises(RecordError, match="no other"):
        run_comparison(settings)


def test_agents_of_one_folder_name_stay_apart_and_new_weights_are_run_anew(tmp_path):
    shipped = load_agent("ppo")
    folders = [tmp_path / parent / "run" for parent in ("a", "b")]
    for number, folder in enumerate(folders):
        changed = replace(shipped.card, seed=number)
        MlpActor(
            changed,
            weights=shipped._weights,
            biases=shipped._biases,
            observation_mean=shipped._mean,
            observation_variance=shipped._variance,
        ).save(folder / "agent")
    beam, sigma = BeamParams(), 0.5
    names = {agent_contestants(folder, beam, sigma)[0].name for folder in folders}
    assert len(names) == 2
    settings = config(tmp_path / "out", contestants=("zero",), agents=tuple(folders))
    run_comparison(settings)
    records = (settings.output / "records.jsonl").read_text().splitlines()[1:]
    assert len(records) == settings.episodes * 5
