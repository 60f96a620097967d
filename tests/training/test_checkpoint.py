"""A checkpoint holds the whole state of a run, and nothing of it is unpickled."""

import pickle

import numpy as np
import pytest
import torch
from outcomes import content
from stable_baselines3.common.logger import Logger

from defmanip_gym.training import train as training
from defmanip_gym.training.checkpoint import read_checkpoint, write_checkpoint
from defmanip_gym.training.environments import make_evaluation_env, make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.lagrangian import LagrangianPenalty
from defmanip_gym.training.model import build_model, callbacks_of
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
from defmanip_gym.training.state_file import read_state, write_state
from defmanip_gym.training.validation_callback import ValidationCallback


@pytest.mark.parametrize("algo", ["ppo", "residual", "lagrangian", "sac", "tqc"])
def test_what_was_read_is_what_was_written(algo, config, tmp_path, monkeypatch):
    monkeypatch.setattr(Sb3VecEnv, "get_state", lambda self: {"steps": 3})
    monkeypatch.setattr(Sb3VecEnv, "set_state", lambda self, state: None)
    settings = config(algo)
    written = training.RunFolder(training.train(settings)).last_checkpoint()
    hyperparameters = load_hyperparameters(settings.hyperparameters, algo, settings.env_id)
    venv = make_training_env(settings, hyperparameters)
    model = build_model(algo, settings.seed + 1, hyperparameters, venv)
    model.set_logger(Logger(None, []))
    evaluation = make_evaluation_env(settings, hyperparameters)
    validation = ValidationCallback(evaluation, episodes=1, interval=1, on_best=lambda: None)
    callbacks = [*callbacks_of(hyperparameters), validation]
    read_checkpoint(written, model, venv, callbacks)
    again = tmp_path / "again"
    again.mkdir()
    write_checkpoint(again, model, venv, callbacks, settings.total_timesteps)
    assert content(again) == content(written)


def test_learned_entropy_coefficients_are_kept(config):
    checkpoint = training.RunFolder(training.train(config("sac"))).last_checkpoint()
    ((_, coefficient),) = (
        (key, value) for key, value in content(checkpoint).items() if "log_ent_coef" in key
    )
    assert np.frombuffer(coefficient, dtype=np.float32) != 0.0  # as it begins


def test_reading_unpickles_nothing(config, monkeypatch):
    settings = config("sac")
    folder = training.train(settings)

    def refuse(*_, **__):
        raise AssertionError("unpickled")

    for name in ("load", "loads"):
        monkeypatch.setattr(pickle, name, refuse)
    monkeypatch.setattr("cloudpickle.loads", refuse)
    load = torch.load
    monkeypatch.setattr(
        torch,
        "load",
        lambda *given, **options: load(*given, **options) if options["weights_only"] else refuse(),
    )
    training.train(training.TrainConfig(resume=folder, total_timesteps=600))


def test_states_come_back_exactly_and_objects_do_not_go_in(tmp_path):
    state = {
        "numbers": [1, 2**127, 0.1, -np.inf, None, True, "text"],
        "array": np.arange(6.0, dtype=np.float32).reshape(2, 3),
        "nested": {"scalar": np.float32(0.1), "flags": np.array([True, False])},
        "empty": np.zeros((0, 3)),
    }
    write_state(tmp_path, state)
    back = read_state(tmp_path)
    assert back["numbers"] == state["numbers"] and type(back["nested"]["scalar"]) is np.float32
    found = (back["array"], back["nested"]["flags"], back["empty"])
    wanted = (state["array"], state["nested"]["flags"], state["empty"])
    for left, right in zip(found, wanted, strict=True):
        assert np.array_equal(left, right) and left.dtype == right.dtype
    with pytest.raises(TypeError):
        write_state(tmp_path, {"object": LagrangianPenalty()})


def test_arrays_of_objects_are_refused(tmp_path):
    with pytest.raises(TypeError, match="objects"):
        write_state(tmp_path, {"objects": np.array([LagrangianPenalty()])})
