"""rl_zoo3 trains from the package's hyperparameter files as they are."""

import os
import subprocess
import sys

import pytest
import yaml

from defmanip_gym.envs.registration import ENV_ID, ENV_IDS
from defmanip_gym.training.config import ALGORITHM_OF
from defmanip_gym.training.hyperparameters import HYPERPARAMETERS

FILES = sorted(HYPERPARAMETERS.glob("*.yml"))

# a run of seconds: less of everything that the files leave open to the command line
SHORT = {
    "ppo": ["n_envs:2", "n_steps:16", "batch_size:16", "n_epochs:1"],
    "sac": ["n_envs:2", "learning_starts:8", "buffer_size:1000"],
    "tqc": ["n_envs:2", "learning_starts:8", "buffer_size:1000"],
}


def test_every_recipe_has_a_file_and_every_file_both_environments():
    assert {path.stem for path in FILES} == set(ALGORITHM_OF)
    for path in FILES:
        assert set(ENV_IDS) <= set(yaml.safe_load(path.read_text()))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_rl_zoo3_accepts_the_file_unchanged(path, tmp_path):
    algorithm = ALGORITHM_OF[path.stem]
    command = [
        *(sys.executable, "-m", "rl_zoo3.cli", "train"),
        *("--algo", algorithm, "--env", ENV_ID, "--gym-packages", "defmanip_gym"),
        *("--conf-file", str(path), "--n-timesteps", "64", "--log-folder", str(tmp_path)),
        *("--eval-freq", "-1", "--seed", "0", "--hyperparams", *SHORT[algorithm]),
    ]
    # threads that wait for each other make seconds minutes where other processes run
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr[-2000:]
    assert list(tmp_path.rglob(f"{ENV_ID}.zip"))
