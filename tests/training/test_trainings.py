"""Many trainings side by side: what is there is kept, and what was interrupted is gone on with."""

import os
import shutil
import signal
import threading
import time

import joblib
import pytest
import yaml

from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import ParameterError, RunFolderError
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.run_folder import RunFolder
from defmanip_gym.training.trainings import run_trainings, train_or_go_on
from defmanip_gym.training.trainings_config import TrainingsConfig

STEPS = 2048


@pytest.fixture
def config(tmp_path):
    def make(**changes):
        small = {"n_envs": 4, "n_steps": 32, "batch_size": 64, "n_epochs": 1}
        path = tmp_path / "ppo.yml"
        path.write_text(yaml.safe_dump({ENV_ID: load_hyperparameters(None, "ppo", ENV_ID) | small}))
        defaults = dict(
            algos=("ppo",),
            seeds=(0, 1),
            total_timesteps=STEPS,
            hyperparameters=path,
            output=tmp_path / "runs",
            evaluations=4,
            evaluation_episodes=2,
            jobs=1,
        )
        return TrainingsConfig(**(defaults | changes))

    return make


def files(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_every_recipe_is_trained_with_every_seed_once():
    settings = TrainingsConfig(algos=("sac", "residual"), seeds=(0, 1, 0), filter="storage")
    runs = [(run.algo, run.seed, run.filter) for run in settings.runs]
    assert runs == [
        ("sac", 0, "storage"),
        ("sac", 1, "storage"),
        ("residual", 0, None),
        ("residual", 1, None),
    ]


def test_settings_that_no_training_takes_are_refused():
    for wrong in ({"algos": ("dqn",)}, {"seeds": (-1,)}, {"filter": "none"}, {"jobs": 0}):
        with pytest.raises(ParameterError):
            TrainingsConfig(**wrong)


def test_finished_trainings_are_kept_and_missing_ones_added(config):
    (first,) = run_trainings(config(seeds=(0,)))
    before = files(first)
    again, added = run_trainings(config())
    assert again == first and files(first) == before
    assert load_agent(added / "last.json").card.seed == 1


def test_a_run_that_ended_before_its_first_checkpoint_begins_anew(config):
    (run,) = config(seeds=(0,)).runs
    path = train_or_go_on(run)
    shutil.rmtree(path / "checkpoints")
    assert train_or_go_on(run) == path
    assert load_agent(path / "last.json").card.total_timesteps == STEPS


def test_a_run_that_train_py_is_at_is_left_alone(config):
    (run,) = config(seeds=(0,)).runs
    path = train_or_go_on(run)
    shutil.rmtree(path / "checkpoints")  # as before its first one
    with RunFolder(path).held(), pytest.raises(RunFolderError, match="nobody trains"):
        train_or_go_on(run)
    assert (path / "config.json").is_file()


def test_a_run_with_other_settings_is_not_gone_on_with(config):
    (run,) = config(seeds=(0,)).runs
    train_or_go_on(run)
    (other,) = config(seeds=(0,), total_timesteps=2 * STEPS).runs
    with pytest.raises(RunFolderError, match="--output"):
        train_or_go_on(other)


def test_a_run_with_other_hyperparameters_is_not_gone_on_with(config):
    (run,) = config(seeds=(0,)).runs
    train_or_go_on(run)
    text = run.hyperparameters.read_text()
    run.hyperparameters.write_text(text.replace("n_steps: 32", "n_steps: 64"))
    with pytest.raises(RunFolderError, match="--output"):
        train_or_go_on(run)


def test_an_output_that_cannot_be_written_is_told(config, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="writable"):
        run_trainings(config(output=tmp_path / "file"))


def test_what_a_killed_worker_had_begun_another_goes_on_with(config):
    distributed = pytest.importorskip("distributed")
    settings = config(total_timesteps=6 * STEPS, jobs=None)
    folders = [settings.output / f"{ENV_ID}-ppo-seed{seed}" for seed in (0, 1)]
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        one = next(iter(client.run(os.getpid).values()))
        killer = threading.Thread(target=kill_once_all_have_checkpoints, args=(one, folders))
        killer.start()
        with joblib.parallel_config(backend="dask"):
            run_trainings(settings)
        killer.join()
    starts = [len(list((folder / "curves").iterdir())) for folder in folders]
    assert sorted(starts) == [1, 2]  # the killed one's run has a second part
    for folder in folders:
        assert load_agent(folder / "last.json").card.total_timesteps == 6 * STEPS


def kill_once_all_have_checkpoints(pid, folders):
    while not all(list(folder.glob("checkpoints/step-*")) for folder in folders):
        time.sleep(0.05)
    os.kill(pid, signal.SIGKILL)
