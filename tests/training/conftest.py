"""Settings of trainings that take a second."""

import pytest

pytest.importorskip("stable_baselines3")

import yaml

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.training.config import ALGORITHM_OF, TrainConfig
from defmanip_gym.training.hyperparameters import load_hyperparameters

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
