"""An interrupted and resumed training is the same training, to the last bit."""

import json
import multiprocessing
import os
import signal
from dataclasses import replace

import pytest
import yaml
from outcomes import outcome

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import RunFolderError
from defmanip_gym.training import train as training
from defmanip_gym.training.callbacks import stop_on_ctrl_c
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.run_folder import RunFolder

PENALTY = "defmanip_gym.training.lagrangian.LagrangianPenalty"
# short episodes, so that some end and others run at every interruption
CHANGES = {
    "lagrangian": {
        "env_kwargs": {"constraint_mode": "cost", "sigma_rad": 0.06, "max_episode_steps": 45},
        "callback": [{PENALTY: {"multiplier": 0.1, "learning_rate": 0.01}}],
    },
    "residual": {"env_kwargs": {"max_episode_steps": 250}},
    # the replay buffer has gone round at the end
    "sac": {"env_kwargs": {"max_episode_steps": 45}, "buffer_size": 400},
}


class Disturbed(training.Checkpoints):
    """Does something once at a step."""

    step, action = 0, None

    def _on_step(self):
        if self.num_timesteps >= self.step and (action := self.action) is not None:
            type(self).action = None
            action()
        return super()._on_step()


def disturbed(at, action):
    return type("Disturbed", (Disturbed,), {"step": at, "action": staticmethod(action)})


def ctrl_c():
    os.kill(os.getpid(), signal.SIGINT)


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def interrupt():
    raise KeyboardInterrupt


@pytest.fixture(autouse=True)
def interrupts():
    """Ctrl-C is heard, though a shell lets what it starts in the background ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def settings(config):
    def make(algo, **changes):
        made = config(algo, total_timesteps=640, evaluations=3, num_threads=1)
        content = yaml.safe_load(made.hyperparameters.read_text())
        default = {"env_kwargs": {"max_episode_steps": 45}}
        content[ENV_ID] |= CHANGES.get(algo, default) | changes
        made.hyperparameters.write_text(yaml.safe_dump(content))
        return made

    return make


@pytest.fixture
def interrupted(monkeypatch, capsys):
    """Train until an action interrupts it at a step, and return folder and last words."""

    def run(settings, step, action):
        with monkeypatch.context() as patch:
            patch.setattr(training, "Checkpoints", disturbed(step, action))
            with pytest.raises(SystemExit) as exit_info:
                training.train(settings)
        assert exit_info.value.code == 130
        (folder,) = [settings.resume] if settings.resume else settings.output.iterdir()
        return folder, capsys.readouterr().out

    return run


def differences(folder, settings):
    """Return what differs between a run and one of the same settings without interruption."""
    expected = outcome(training.train(replace(settings, output=settings.output / "whole")))
    found = outcome(folder)
    return [key for key in expected.keys() | found.keys() if expected.get(key) != found.get(key)]


@pytest.mark.parametrize(
    ("algo", "step"),
    # 30: before learning starts; the others: within an on-policy rollout
    [("ppo", 300), ("residual", 300), ("lagrangian", 300), ("sac", 30), ("sac", 300), ("tqc", 300)],
)
def test_a_run_goes_on_after_ctrl_c_as_if_nothing_had_been(algo, step, settings, interrupted):
    given = settings(algo)
    folder, words = interrupted(given, step, ctrl_c)
    assert f"--resume {folder}" in words
    assert training.train(TrainConfig(resume=folder)) == folder
    assert differences(folder, given) == []


def test_a_run_inside_a_filter_goes_on_as_if_nothing_had_been(settings, interrupted):
    given = replace(settings("ppo"), filter="storage")
    folder, _ = interrupted(given, 300, ctrl_c)
    training.train(TrainConfig(resume=folder))
    assert differences(folder, given) == []


def train_and_die(settings):
    training.Checkpoints = disturbed(400, die)
    training.train(settings)


def test_a_killed_run_goes_on_from_its_last_checkpoint(settings):
    given = settings("sac")
    process = multiprocessing.get_context("spawn").Process(target=train_and_die, args=(given,))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    (folder,) = given.output.iterdir()
    assert RunFolder(folder).last_checkpoint().name == "step-0000000216"
    training.train(TrainConfig(resume=folder))
    assert differences(folder, given) == []


def test_an_interruption_at_once_loses_what_came_since_the_last_checkpoint(settings, interrupted):
    given = settings("ppo")
    folder, words = interrupted(given, 500, interrupt)
    assert "Stopped at 500 steps" in words and "step-0000000256" in words
    training.train(TrainConfig(resume=folder))
    assert differences(folder, given) == []


def test_a_run_without_checkpoint_is_to_be_started_anew(settings, interrupted):
    folder, words = interrupted(settings("ppo"), 8, interrupt)
    assert "start the run anew" in words
    with pytest.raises(RunFolderError, match="anew"):
        training.train(TrainConfig(resume=folder))


def test_a_longer_run_keeps_its_length_when_it_is_interrupted(settings, interrupted):
    folder = training.train(settings("ppo"))
    longer = TrainConfig(resume=folder, total_timesteps=1024)
    interrupted(longer, 700, ctrl_c)
    training.train(TrainConfig(resume=folder))
    assert RunFolder(folder).last_checkpoint().name == "step-0000001024"


def test_checkpoints_of_the_old_format_are_refused_by_name(settings):
    folder = training.train(settings("ppo"))
    path = RunFolder(folder).last_checkpoint() / "state.json"
    content = json.loads(path.read_text())
    del content["format"]
    path.write_text(json.dumps(content))
    for total in (None, 1024):
        with pytest.raises(RunFolderError, match="format of a checkpoint is '1"):
            training.train(TrainConfig(resume=folder, total_timesteps=total))


def test_ctrl_c_is_pythons_own_again_after_training_and_nobody_elses_is_taken(config):
    training.train(config())
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with stop_on_ctrl_c() as stop:
            ctrl_c()
        assert not stop.asked
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def test_a_second_ctrl_c_interrupts_at_once():
    with pytest.raises(KeyboardInterrupt), stop_on_ctrl_c() as stop:
        ctrl_c()
        assert stop.asked
        ctrl_c()
