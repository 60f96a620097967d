"""What cannot be trained, resumed or loaded is refused by name."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import AgentFileError, ParameterError, RunFolderError
from defmanip_gym.evaluation.seeds import VALIDATION_SEED
from defmanip_gym.training import train as training
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.environments import make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.model import build_model
from defmanip_gym.training.run_folder import RunFolder

RESIDUAL = "defmanip_gym.baselines.residual_action.ResidualAction"
PENALTY = "defmanip_gym.training.lagrangian.LagrangianPenalty"


@pytest.fixture
def folder(tmp_path):
    """A run folder without a run."""
    settings = TrainConfig(output=tmp_path)
    return RunFolder.create(settings, load_hyperparameters(None, "ppo", ENV_ID), "train").path


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


def test_no_run_trains_on_starts_that_agents_are_judged_on(config):
    settings = config(seed=VALIDATION_SEED - 3)  # four episodes
    with pytest.raises(ParameterError, match="seed"):
        training.train(settings)
    assert not settings.output.exists()
    venv = make_training_env(replace(settings, seed=VALIDATION_SEED - 4), {"n_envs": 4})
    model = build_model("ppo", VALIDATION_SEED - 4, load_hyperparameters(None, "ppo", ENV_ID), venv)
    assert model.env.venv._seeds[-1] == VALIDATION_SEED - 1
    venv.close()


def test_an_output_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").touch()
    for output in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(RunFolderError, match="a writable folder"):
            RunFolder.create(TrainConfig(output=output), {}, "train")


def test_incomplete_hyperparameters_are_refused_and_leave_nothing(config, tmp_path):
    path = tmp_path / "short.yml"
    path.write_text(yaml.safe_dump({ENV_ID: {"policy": "MlpPolicy"}}))
    with pytest.raises(ParameterError, match="n_envs"):
        training.train(config(hyperparameters=path))
    assert not (tmp_path / "runs").exists()


def test_residual_learns_in_its_own_certificate_only():
    with pytest.raises(ParameterError, match="certificate"):
        TrainConfig(algo="residual", certificate="l1")
    with pytest.raises(ParameterError, match="filter is 'storage'"):
        TrainConfig(algo="residual", filter="storage")


def test_a_run_learns_inside_one_filter_only():
    with pytest.raises(ParameterError, match="none beside --certificate l1"):
        TrainConfig(certificate="l1", filter="storage")
    with pytest.raises(ParameterError, match="filter"):
        TrainConfig(filter="nu_max")


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
        {"train": {"filter": 3}},
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
