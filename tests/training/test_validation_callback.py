"""The agent of a run is the best on the validation starts, not the last."""

import gymnasium
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback, EveryNTimesteps

from defmanip_gym.baselines.residual_action import ResidualVectorAction
from defmanip_gym.envs.registration import ROBUST_ENV_ID
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
from defmanip_gym.training.validation_callback import ValidationCallback


def batch():
    return gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0", num_envs=1, autoreset_mode="SameStep"
    )


def episode(success, length, cost=0.0):
    return {"done": True, "info": {"is_success": success, "episode": {"l": length, "cost": cost}}}


@pytest.fixture
def callback():
    env = Sb3VecEnv(batch())
    yield ValidationCallback(env, episodes=1, interval=1, on_best=lambda: None)
    env.close()


def test_only_arrivals_without_violation_score_and_sooner_is_better(callback):
    callback._is_success_buffer = []
    for one in (episode(True, 250), episode(True, 250, cost=3.0), episode(False, 1000)):
        callback._log_success_callback(one, {})
    assert callback._episode_scores == [0.75, 0.0, 0.0]


def test_decisions_that_are_held_count_against_decisions():
    env = Sb3VecEnv(ResidualVectorAction(batch(), decision_periods=25))
    callback = ValidationCallback(env, episodes=1, interval=1, on_best=lambda: None)
    callback._is_success_buffer = []
    callback._log_success_callback(episode(True, 10), {})  # 10 of 40 decisions
    assert callback._episode_scores == [0.75]
    env.close()


def test_a_checkpoint_keeps_the_best_score(callback):
    callback.best_score = 0.6
    state = callback.state()
    callback.best_score = 0.0
    callback.set_state(state)
    assert callback.best_score == 0.6


def test_every_evaluation_has_the_same_starts_so_that_their_scores_compare():
    train, validate = (
        Sb3VecEnv(
            gymnasium.make_vec(
                f"defmanip_gym:{ROBUST_ENV_ID}", num_envs=2, autoreset_mode="SameStep"
            )
        )
        for _ in range(2)
    )
    returns = []
    callback = ValidationCallback(validate, episodes=2, interval=8, on_best=lambda: None)
    watch = EveryNTimesteps(16, Told(lambda: returns.append(callback.last_mean_reward)))
    model = PPO("MlpPolicy", train, learning_rate=0.0, n_steps=8, batch_size=16, n_epochs=1, seed=0)
    model.learn(48, callback=[callback, watch])
    assert len(returns) == 3 and len(set(returns)) == 1
    train.close()
    validate.close()


class Told(BaseCallback):
    """Calls a function."""

    def __init__(self, tell):
        super().__init__()
        self.tell = tell

    def _on_step(self):
        self.tell()
        return True
