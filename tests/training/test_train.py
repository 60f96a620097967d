"""Training runs leave complete folders, go on where they stopped, and export what they learned."""

import json
import shlex
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import tyro
import yaml
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from defmanip_gym.baselines.analytic.field import FieldController
from defmanip_gym.baselines.filtered import FilteredController
from defmanip_gym.baselines.learned.agents import load_agent, load_controller
from defmanip_gym.baselines.learned.deployment import training_config
from defmanip_gym.envs.registration import ENV_ID, RANDOMIZED_ENV_ID
from defmanip_gym.errors import ParameterError, RunFolderError
from defmanip_gym.evaluation.learned_contestants import agent_contestants
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.training import train as training
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.environments import make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.model import build_model
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv


class NoCallback(BaseCallback):
    """Does nothing."""

    def _on_step(self):
        return True


def last_model(folder, config):
    """Return the run's last SB3 model and its normalization."""
    hyperparameters = load_hyperparameters(config.hyperparameters, config.algo, config.env_id)
    venv = make_training_env(config, hyperparameters)
    model = build_model(config.algo, config.seed, hyperparameters, venv)
    model.set_logger(Logger(None, []))
    checkpoint = training.RunFolder(folder).last_checkpoint()
    kept = json.loads((checkpoint / "state.json").read_text())["callbacks"]
    training.read_checkpoint(checkpoint, model, venv, [NoCallback() for _ in kept])
    return model, venv


def sb3_actions(folder, config, observations):
    """The actions of the run's last SB3 model, normalized as in training."""
    model, venv = last_model(folder, config)
    return model.predict(venv.normalize_obs(observations), deterministic=True)[0]


@pytest.mark.parametrize(
    "settings",
    [
        TrainConfig(),
        TrainConfig(algo="sac", env="DeformTransport-v1", filter="storage", seed=3),
        TrainConfig(certificate="l1", total_timesteps=10, evaluations=3, num_threads=2),
        TrainConfig(hyperparameters=Path("my ppo.yml"), output=Path("elsewhere")),
    ],
)
def test_a_run_tells_a_command_that_makes_it_again(settings):
    python, script, *words = shlex.split(training.command_of(settings))
    assert (python, script) == ("python", "train.py")
    again = tyro.cli(TrainConfig, args=words)
    assert again == replace(settings, output=again.output, num_threads=again.num_threads)


@pytest.mark.parametrize("algo", ["ppo", "sac", "tqc", "residual", "lagrangian"])
def test_exported_agent_acts_as_the_trained_model(algo, config):
    settings = config(algo)
    folder = training.train(settings)
    env = gymnasium.make(f"defmanip_gym:{ENV_ID}")
    observations = np.array([env.reset(seed=seed)[0] for seed in range(8)])
    actions, _ = load_agent(folder / "last.json").predict(observations)
    assert actions == pytest.approx(sb3_actions(folder, settings, observations), abs=1e-5)
    stored = json.loads((folder / "config.json").read_text())
    assert stored["train"]["algo"] == algo and stored["git_revision"]
    assert {path.name for path in folder.iterdir()} == {
        ".lock",
        "config.json",
        "curves",
        "checkpoints",
        "agent.json",
        "agent.safetensors",
        "last.json",
        "last.safetensors",
    }
    (progress,) = (folder / "curves").rglob("progress.csv")
    assert progress.stat().st_size > 0


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_resumed_run_goes_on_from_its_checkpoint(algo, config):
    folder = training.train(config(algo))
    before = load_agent(folder / "last.json").card.total_timesteps
    again = training.train(TrainConfig(resume=folder, total_timesteps=1024))
    assert again == folder
    assert load_agent(folder / "last.json").card.total_timesteps == 1024 > before
    curves = sorted((folder / "curves").rglob("progress.csv"))
    assert len(curves) == 2 and all(curve.stat().st_size > 0 for curve in curves)
    assert training.train(TrainConfig(resume=folder)) == folder  # finished: nothing to do
    assert sorted((folder / "curves").rglob("progress.csv")) == curves


def test_returns_end_at_an_interruption_that_episodes_do_not_outlive(config, monkeypatch):
    monkeypatch.setattr(Sb3VecEnv, "get_state", lambda self: None)  # as an unknown wrapper makes it
    settings = config("sac")
    model, _ = last_model(training.train(settings), settings)
    buffer = model.replay_buffer
    assert buffer.n_steps > 1
    last = buffer.pos - 1
    assert np.logical_or(buffer.timeouts[last], buffer.dones[last]).all()
    assert not buffer.timeouts[:last].any()


def test_the_agent_of_a_run_is_the_best_on_the_validation_starts(config, monkeypatch):
    scores = iter([0.2, 0.5, 0.3, 0.1])

    def evaluated(self):
        self.score = next(scores)
        return self.score

    monkeypatch.setattr(training.ValidationCallback, "_mean_score", evaluated)
    folder = training.train(config(evaluations=4))
    assert load_agent(folder).card.total_timesteps == 256
    assert load_agent(folder / "last.json").card.total_timesteps == 512


def test_price_of_violations_survives_an_interruption(config):
    folder = training.train(config("lagrangian"))
    state = training.RunFolder(folder).last_checkpoint() / "state.json"
    content = json.loads(state.read_text())
    content["callbacks"][0]["own"]["multiplier"] = 2.5
    state.write_text(json.dumps(content))
    training.train(TrainConfig(resume=folder, total_timesteps=640))
    again = training.RunFolder(folder).last_checkpoint() / "state.json"
    penalty, _ = json.loads(again.read_text())["callbacks"]
    assert penalty["own"]["multiplier"] == pytest.approx(2.5, abs=0.1)


def test_randomized_beams_train_under_their_own_name(config, tmp_path):
    settings = config()
    content = yaml.safe_load(settings.hyperparameters.read_text())
    settings.hyperparameters.write_text(yaml.safe_dump({RANDOMIZED_ENV_ID: content[ENV_ID]}))
    folder = training.train(replace(settings, env=f"defmanip_gym:{RANDOMIZED_ENV_ID}"))
    assert load_agent(folder).card.env_id == RANDOMIZED_ENV_ID
    assert RANDOMIZED_ENV_ID in folder.name


def test_a_run_folder_keeps_the_hyperparameters_as_they_were_in_the_file(config):
    settings = config()
    stored = json.loads((training.train(settings) / "config.json").read_text())
    assert stored["hyperparameters"] == load_hyperparameters(
        settings.hyperparameters, "ppo", ENV_ID
    )


def test_one_seed_trains_one_agent(config):
    first, second = (load_agent(training.train(config())) for _ in range(2))
    observation = np.linspace(-1, 1, first.observation_size)
    assert np.array_equal(first.predict(observation)[0], second.predict(observation)[0])


def test_training_under_a_certificate_is_recorded(config):
    folder = training.train(config(certificate="l1"))
    assert load_agent(folder).card.certificate == "l1"
    assert "l1" in folder.name


def test_training_inside_a_filter_is_recorded_and_so_are_its_evaluations(config, monkeypatch):
    inside = []

    def evaluated(self):
        env = self.eval_env.venv.env
        inside.append(type(env).__name__)
        return float(env.filtering.steps > 0 and env.filtering.applies.all())

    monkeypatch.setattr(training.ValidationCallback, "_mean_score", evaluated)
    folder = training.train(config(filter="storage"))
    card = load_agent(folder).card
    assert card.safety_filter == card.trained_inside == "storage" and card.certificate is None
    assert card.filter_specification["name"] == "storage"
    assert isinstance(load_controller(folder), FilteredController)
    assert "-ppo-storage-seed" in folder.name
    assert inside == ["SafetyFilterVectorWrapper"] * 2
    assert json.loads((folder / "config.json").read_text())["train"]["filter"] == "storage"


def test_a_residual_of_a_registered_controller_is_deployed_above_it_and_inside_its_filter(config):
    settings = config("residual")
    content = yaml.safe_load(settings.hyperparameters.read_text())
    wrapper = {"base": "field", "inside": "storage", "decision_periods": 2, "authority": 0.5}
    content[ENV_ID] |= {
        "env_kwargs": {"inner_loop": "measured_force"},
        "env_wrapper": [{"defmanip_gym.baselines.residual_action.ResidualAction": wrapper}],
    }
    settings.hyperparameters.write_text(yaml.safe_dump(content))
    folder = training.train(settings)
    card = load_agent(folder).card
    assert (card.residual_base, card.trained_inside) == ("field", "storage")
    assert card.residual_authority_m_s2 == 1.5
    assert training_config(card).inner_loop == "measured_force"
    controller = load_controller(folder)
    assert isinstance(controller, FilteredController)
    assert isinstance(controller.controller.base, FieldController)
    contestant, inside = agent_contestants(folder, Certificates())
    assert {contestant.inner_loop, inside.inner_loop} == {"measured_force"}
    assert contestant.members[0].controller.identity["base"]["controller"] == "field"


def test_a_residual_needs_the_inner_loop_of_its_base(config):
    settings = config("residual")
    content = yaml.safe_load(settings.hyperparameters.read_text())
    wrapper = {"base": "field", "inside": "storage"}
    content[ENV_ID]["env_wrapper"] = [
        {"defmanip_gym.baselines.residual_action.ResidualAction": wrapper}
    ]
    settings.hyperparameters.write_text(yaml.safe_dump(content))
    with pytest.raises(ParameterError, match="inner_loop='measured_force'"):
        training.train(settings)


def test_changed_sources_are_not_gone_on_with(config, monkeypatch):
    folder = training.train(config())
    monkeypatch.setattr(training, "sources_digest", lambda: "another")
    with pytest.raises(RunFolderError, match="train anew"):
        training.train(TrainConfig(resume=folder, total_timesteps=1024))


def test_the_filter_of_a_training_knows_what_the_environment_draws_and_how_late_actions_are(config):
    settings = config(filter="storage")
    drawn = {"env_kwargs": {"beam_ranges": {"mass_kg": [2.8, 3.4]}}}
    venv = make_training_env(settings, load_hyperparameters(None, "ppo", ENV_ID) | drawn)
    filtering = venv.venv.env.filtering
    venv.reset()
    assert filtering.applies.all()
    believed = filtering._filter
    assert believed.covers(replace(believed.beam, mass_kg=2.8))
    assert not believed.covers(replace(believed.beam, mass_kg=2.5))
    venv.close()


def test_half_written_checkpoints_never_appear(config, monkeypatch):
    folder = training.RunFolder(config().output)
    folder.path.mkdir()

    def fail(path):
        (path / "half").write_text("x")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        folder.save_checkpoint(1, fail)
    assert list((folder.path / "checkpoints").iterdir()) == []
