"""Training runs leave complete folders, go on where they stopped, and export what they learned."""

import json
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
import yaml
from stable_baselines3.common.callbacks import BaseCallback

from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.envs.registration import ENV_ID, RANDOMIZED_ENV_ID
from defmanip_gym.errors import AgentFileError, ParameterError, RunFolderError
from defmanip_gym.training import train as training
from defmanip_gym.training.config import ALGORITHM_OF, TrainConfig
from defmanip_gym.training.environments import make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.model import build_model
from defmanip_gym.training.run_folder import RunFolder

OFF_POLICY = {"n_envs": 4, "learning_starts": 50, "gradient_steps": 1, "buffer_size": 1000}
SMALL = {
    "ppo": {"n_envs": 4, "n_steps": 32, "batch_size": 64, "n_epochs": 1},
    "sac": OFF_POLICY,
    "tqc": OFF_POLICY,
}


@pytest.fixture
def config(tmp_path):
    def make(algo="ppo", **changes):
        hyperparameters = load_hyperparameters(None, algo, ENV_ID) | SMALL[ALGORITHM_OF[algo]]
        path = tmp_path / f"{algo}.yml"
        path.write_text(yaml.safe_dump({ENV_ID: hyperparameters}))
        defaults = dict(
            algo=algo,
            total_timesteps=512,
            output=tmp_path / "runs",
            hyperparameters=path,
            evaluations=2,
            evaluation_episodes=2,
        )
        return TrainConfig(**(defaults | changes))

    return make


class Deaf:
    """A callback that takes whatever a checkpoint kept."""

    def state(self):
        return {}

    def set_state(self, state):
        pass


def last_model(folder, config):
    """Return the run's last SB3 model and its normalization."""
    hyperparameters = load_hyperparameters(config.hyperparameters, config.algo, config.env_id)
    venv = make_training_env(config, hyperparameters)
    model = build_model(config.algo, config.seed, hyperparameters, venv)
    checkpoint = training.RunFolder(folder).last_checkpoint()
    kept = json.loads((checkpoint / "state.json").read_text())["callbacks"]
    training.read_checkpoint(checkpoint, model, venv, [Deaf() for _ in kept])
    return model, venv


def sb3_actions(folder, config, observations):
    """The actions of the run's last SB3 model, normalized as in training."""
    model, venv = last_model(folder, config)
    return model.predict(venv.normalize_obs(observations), deterministic=True)[0]


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


def test_returns_over_several_steps_end_where_a_run_was_interrupted(config):
    settings = config("sac")
    model, _ = last_model(training.train(settings), settings)
    buffer = model.replay_buffer
    assert buffer.n_steps > 1
    last = buffer.pos - 1
    assert np.logical_or(buffer.timeouts[last], buffer.dones[last]).all()
    assert not buffer.timeouts[:last].any()


def test_interrupted_run_keeps_its_state_and_says_how_to_go_on(config, monkeypatch, capsys):
    class Interrupt(BaseCallback):
        def __init__(self, *_):
            super().__init__()

        def _on_step(self):
            if self.num_timesteps >= 256:
                raise KeyboardInterrupt
            return True

    monkeypatch.setattr(training, "Periodically", Interrupt)
    with pytest.raises(SystemExit) as exit_info:
        training.train(config())
    assert exit_info.value.code == 130
    assert "--resume" in (message := capsys.readouterr().out)
    folder = training.Path(message.split("--resume ")[1].strip())
    assert load_agent(folder / "last.json").card.total_timesteps == 256
    monkeypatch.undo()
    training.train(TrainConfig(resume=folder))
    assert load_agent(folder / "last.json").card.total_timesteps == 512


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
    content["callbacks"][0] = {"multiplier": 2.5}
    state.write_text(json.dumps(content))
    training.train(TrainConfig(resume=folder, total_timesteps=640))
    again = training.RunFolder(folder).last_checkpoint() / "state.json"
    numbers, _ = json.loads(again.read_text())["callbacks"]
    assert numbers["multiplier"] == pytest.approx(2.5, abs=0.1)


def test_randomized_beams_train_under_their_own_name(config, tmp_path):
    settings = config()
    content = yaml.safe_load(settings.hyperparameters.read_text())
    settings.hyperparameters.write_text(yaml.safe_dump({RANDOMIZED_ENV_ID: content[ENV_ID]}))
    folder = training.train(replace(settings, env=f"defmanip_gym:{RANDOMIZED_ENV_ID}"))
    assert load_agent(folder).card.env_id == RANDOMIZED_ENV_ID
    assert RANDOMIZED_ENV_ID in folder.name


RESIDUAL = "defmanip_gym.baselines.residual_action.ResidualAction"
PENALTY = "defmanip_gym.training.lagrangian.LagrangianPenalty"


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"env_wrapper": "gymnasium.wrappers.ClipAction"}, "vector_wrapper"),
        ({"env_wrapper": "no.such.Wrapper"}, "imported"),
        ({"env_wrapper": ".relative.Wrapper"}, "imported"),
        ({"env_wrapper": [{"two": {}, "keys": {}}]}, "indentation"),
        ({"env_wrapper": {RESIDUAL: {"colour": "red"}}}, "env_wrapper.*colour"),
        ({"env_kwargs": {"colour": "red"}}, "colour"),
        ({"env_kwargs": {"vectorization_mode": "red"}}, "env_kwargs.*red"),
        ({"callback": "collections.OrderedDict"}, "callback.*OrderedDict"),
        ({"callback": {PENALTY: {"colour": "red"}}}, "callback.*colour"),
        ({"n_envs": 0}, "n_envs"),
        ({"n_timesteps": "many"}, "n_timesteps"),
        ({"normalize": False}, "normalize is False"),
        ({"gamma": "a"}, "gamma is 'a'"),
        ({"gamma": 2}, "gamma is 2"),
        ({"learning_rate": "abc"}, "learning_rate is 'abc'"),
        ({"learning_rate": "lin_x"}, "learning_rate is 'lin_x'"),
        ({"learning_rate": -1.0}, "learning_rate is -1"),
        ({"ent_coef": "1e-3"}, "ent_coef is '1e-3'"),
        ({"noise_type": "red"}, "noise_type is 'red'"),
        ({"noise_type": "normal"}, "noise_std is None"),
        ({"policy_kwargs": {"net_arch": [-1]}}, "net_arch"),
        ({"colour": "red"}, "colour"),
        ({"batch_size": -3}, "batch_size"),
    ],
)
def test_unusable_hyperparameters_are_refused_by_name_and_leave_nothing(change, named, config):
    settings = config()
    content = yaml.safe_load(settings.hyperparameters.read_text())
    content[ENV_ID] |= change
    settings.hyperparameters.write_text(yaml.safe_dump(content))
    with pytest.raises(ParameterError, match=named):
        training.train(settings)
    assert not settings.output.exists()


def test_a_run_folder_keeps_the_hyperparameters_as_they_were_in_the_file(config):
    settings = config()
    stored = json.loads((training.train(settings) / "config.json").read_text())
    assert stored["hyperparameters"] == load_hyperparameters(
        settings.hyperparameters, "ppo", ENV_ID
    )


def test_residual_learns_in_its_own_certificate_only():
    with pytest.raises(ParameterError, match="certificate"):
        TrainConfig(algo="residual", certificate="l1")


def test_one_seed_trains_one_agent(config):
    first, second = (load_agent(training.train(config())) for _ in range(2))
    observation = np.linspace(-1, 1, first.observation_size)
    assert np.array_equal(first.predict(observation)[0], second.predict(observation)[0])


def test_training_under_a_certificate_is_recorded(config):
    folder = training.train(config(certificate="l1"))
    assert load_agent(folder).card.certificate == "l1"
    assert "l1" in folder.name


def test_half_written_checkpoints_never_appear(config, monkeypatch):
    folder = training.RunFolder(config().output)
    folder.path.mkdir()

    def fail(path):
        (path / "half").write_text("x")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        folder.save_checkpoint(1, fail)
    assert list((folder.path / "checkpoints").iterdir()) == []


def test_bad_runs_are_refused_by_name(config, tmp_path):
    with pytest.raises(RunFolderError, match=r"train\.py"):
        training.train(TrainConfig(resume=tmp_path))
    with pytest.raises(ParameterError, match="YAML"):
        training.train(replace(config(), hyperparameters=tmp_path / "missing.yml"))
    with pytest.raises(ParameterError, match="seed"):
        TrainConfig(seed=1_000_000)
    with pytest.raises(ParameterError, match="total_timesteps"):
        TrainConfig(total_timesteps=0)
    with pytest.raises(ParameterError, match="env"):
        TrainConfig(env="CartPole-v1")


def test_damaged_checkpoint_is_refused_by_name(config):
    folder = training.train(config("sac"))
    checkpoint = training.RunFolder(folder).last_checkpoint()
    for path in sorted(checkpoint.iterdir()):
        whole = path.read_bytes()
        for damage in (b"", whole[: len(whole) // 2], b"nonsense", b"[]"):
            path.write_bytes(damage)
            with pytest.raises(RunFolderError, match="checkpoint"):
                training.train(TrainConfig(resume=folder, total_timesteps=1024))
        path.write_bytes(whole)


def test_incomplete_hyperparameters_are_refused_and_leave_nothing(config, tmp_path):
    path = tmp_path / "short.yml"
    path.write_text(yaml.safe_dump({ENV_ID: {"policy": "MlpPolicy"}}))
    with pytest.raises(ParameterError, match="n_envs"):
        training.train(config(hyperparameters=path))
    assert not (tmp_path / "runs").exists()


@pytest.fixture
def folder(tmp_path):
    """A run folder without a run."""
    settings = TrainConfig(output=tmp_path)
    return RunFolder.create(settings, load_hyperparameters(None, "ppo", ENV_ID), "train").path


@pytest.mark.parametrize(
    "damage",
    [
        {"command": None},
        {"hyperparameters": []},
        {"hyperparameters": {"n_timesteps": "a"}},
        {"train": {}},
        {"train": []},
        {"train": None},
        {"train": {"colour": "red"}},
        {"train": {"output": None}},
        {"train": {"total_timesteps": "a"}},
        {"train": {"seed": 0.5}},
        {"train": {"certificate": 3}},
    ],
)
def test_a_damaged_configuration_is_refused_by_name(damage, folder):
    content = json.loads((folder / "config.json").read_text())
    for key, value in damage.items():
        content[key] = content[key] | value if value else value
    (folder / "config.json").write_text(json.dumps(content))
    with pytest.raises(RunFolderError, match=r"config\.json"):
        training.train(TrainConfig(resume=folder))


@pytest.mark.parametrize("text", ["", "null", "[]", "{", "\udcff"])
def test_a_file_that_is_no_configuration_is_refused(text, folder):
    (folder / "config.json").write_text(text, errors="surrogateescape")
    with pytest.raises(RunFolderError, match=r"config\.json"):
        training.train(TrainConfig(resume=folder))


def test_a_run_of_another_version_is_not_resumed(folder):
    content = json.loads((folder / "config.json").read_text()) | {"package_version": "0.0.1"}
    (folder / "config.json").write_text(json.dumps(content))
    with pytest.raises(RunFolderError, match=r"0\.0\.1"):
        training.train(TrainConfig(resume=folder))


def test_missing_damaged_and_foreign_agents_are_refused(config, tmp_path):
    with pytest.raises(AgentFileError, match="Check the name"):
        load_agent("no-such-agent")
    with pytest.raises(AgentFileError, match="JSON"):
        load_agent(tmp_path)
    folder = training.train(config())
    checkpoint = training.RunFolder(folder).last_checkpoint()
    with pytest.raises(AgentFileError, match="run code"):
        load_agent(checkpoint / "model.zip")
    with pytest.raises(AgentFileError, match="22"):
        load_agent(folder).predict(np.zeros(21))
    tensors = folder / "agent.safetensors"
    tensors.write_bytes(tensors.read_bytes()[:100])
    with pytest.raises(AgentFileError, match="damaged"):
        load_agent(folder)
    (folder / "agent.json").write_text("{}")
    with pytest.raises(AgentFileError, match="format"):
        load_agent(folder)
