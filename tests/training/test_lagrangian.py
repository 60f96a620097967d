"""The price of violations rises until the cost limit is kept, and survives interruptions."""

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_util import make_vec_env

from defmanip_gym.errors import ParameterError
from defmanip_gym.training.lagrangian import LagrangianPenalty
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv


class Violating(gymnasium.Env):
    """Costs one in every step of its episodes of four, and rewards two."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        self.count = 0
        return np.zeros(2, np.float32), {}

    def step(self, action):
        self.count += 1
        return np.zeros(2, np.float32), 2.0, self.count == 4, False, {"cost": 1.0}


def trained(callback, env=None, steps=32):
    venv = make_vec_env(Violating, n_envs=2) if env is None else env
    model = PPO("MlpPolicy", venv, n_steps=8, batch_size=16, n_epochs=1, seed=0)
    model.learn(steps, callback=callback)
    return model


def test_stored_rewards_lack_the_price_of_the_cost():
    penalty = LagrangianPenalty(multiplier=0.5, learning_rate=1e-9)
    rewards = trained(penalty, steps=16).rollout_buffer.rewards
    assert rewards == pytest.approx(np.full((8, 2), 1.5))


def test_price_rises_by_the_excess_over_the_limit_after_every_rollout():
    penalty = LagrangianPenalty(cost_limit=1.0, multiplier=0.0, learning_rate=0.01)
    trained(penalty, steps=32)  # two rollouts, every episode costs 4
    assert penalty.multiplier == pytest.approx(0.01 * 3.0 * 2)


def test_price_falls_to_zero_where_the_limit_is_generous():
    penalty = LagrangianPenalty(cost_limit=100.0, multiplier=0.5, learning_rate=0.1)
    trained(penalty)
    assert penalty.multiplier == 0.0


def test_batched_environment_tells_every_steps_cost():
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=4,
        autoreset_mode="SameStep",
        constraint_mode="cost",
        sigma_rad=0.06,
    )
    venv = Sb3VecEnv(env)
    venv.seed(0)
    venv.reset()
    told, expected = 0.0, 0.0
    for _ in range(60):
        _, _, dones, infos = venv.step(np.ones((4, 3)))
        told += sum(info.get("cost", 0.0) for info in infos)
        last = venv.step_info.get("final_info", venv.step_info)["cost"]
        expected += np.where(dones, last, venv.step_info["cost"]).sum()
    assert told == expected > 0


def test_algorithms_with_a_replay_buffer_are_refused():
    model = SAC("MlpPolicy", make_vec_env(Violating, n_envs=1), buffer_size=100)
    with pytest.raises(ParameterError, match="on-policy"):
        model.learn(8, callback=LagrangianPenalty())


@pytest.mark.parametrize(
    "options", [{"cost_limit": -1.0}, {"learning_rate": 0.0}, {"multiplier": -0.1}]
)
def test_impossible_settings_are_refused(options):
    with pytest.raises(ParameterError):
        LagrangianPenalty(**options)
