"""A study goes on where it stopped, begins with the file's own values, and tells of all trials."""

import optuna
import pytest
import yaml

from defmanip_gym.errors import ParameterError, RunFolderError
from defmanip_gym.training import tuning
from defmanip_gym.training.config import ALGORITHM_OF
from defmanip_gym.training.environments import make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.model import build_model
from defmanip_gym.training.search_spaces import SEARCH_SPACES
from defmanip_gym.training.tune_config import TuneConfig


@pytest.fixture
def quick(monkeypatch):
    """Trials whose score is their number, without training."""
    monkeypatch.setattr(tuning, "_objective", lambda config, trial: float(trial.number))


def config(tmp_path, **changes):
    return TuneConfig(**({"trials": 3, "output": tmp_path} | changes))


def test_a_second_run_adds_what_is_missing(quick, tmp_path):
    first = tuning.run_tune(config(tmp_path, trials=2)).read_text()
    again = tuning.run_tune(config(tmp_path, trials=5)).read_text()
    header = 2
    assert first.count("\n| ") == header + 2 and again.count("\n| ") == header + 5
    assert tuning.run_tune(config(tmp_path, trials=5)).read_text() == again


def test_ctrl_c_keeps_finished_trials_and_says_how_to_go_on(monkeypatch, tmp_path, capsys):
    def objective(config, trial):
        if trial.number == 2:
            raise KeyboardInterrupt
        return 1.0

    monkeypatch.setattr(tuning, "_objective", objective)
    with pytest.raises(SystemExit) as exit_info:
        tuning.run_tune(config(tmp_path))
    assert exit_info.value.code == 130 and "Go on" in capsys.readouterr().out
    monkeypatch.setattr(tuning, "_objective", lambda config, trial: 2.0)
    table = tuning.run_tune(config(tmp_path, trials=4)).read_text()
    assert "1.000" in table and "2.000" in table


def test_a_short_trial_trains_and_is_scored(tmp_path):
    table = tuning.run_tune(
        config(tmp_path, trials=1, timesteps=4096, evaluations=1, evaluation_episodes=2)
    ).read_text()
    assert "0.000" in table and "defmanip tune" in table


@pytest.mark.parametrize("algo", sorted(ALGORITHM_OF))
def test_every_recipe_has_a_search_space_that_its_algorithm_takes(algo, tmp_path):
    settings = config(tmp_path, algo=algo)
    trial = optuna.create_study().ask()
    hyperparameters = load_hyperparameters(None, algo, settings.env) | SEARCH_SPACES[algo](trial)
    yaml.safe_dump(hyperparameters)  # what was found can be written into a file
    venv = make_training_env(settings.training, hyperparameters)
    build_model(algo, 0, hyperparameters, venv)
    venv.close()


def test_bad_settings_are_refused_by_name(quick, tmp_path):
    with pytest.raises(ParameterError, match="trials"):
        config(tmp_path, trials=0)
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="output"):
        tuning.run_tune(config(tmp_path, output=tmp_path / "file"))
