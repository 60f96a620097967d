import gymnasium
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import CallbackList
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.errors import ParameterError
from defmanip_gym.training.rising_discount import RisingDiscount
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv


def learner():
    batch = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v1", num_envs=2, num_threads=1, autoreset_mode="SameStep"
    )
    env = VecNormalize(Sb3VecEnv(batch), gamma=0.9)
    return PPO("MlpPolicy", env, n_steps=4, batch_size=8, n_epochs=1, seed=0, gamma=0.9)


class Record(RisingDiscount):
    """Notes the discount of every rollout."""

    def _on_rollout_end(self):
        buffer = self.model.rollout_buffer
        assert buffer.gamma == self.model.gamma == self.model.get_vec_normalize_env().gamma
        seen.append(round(self.model.gamma, 4))


seen = []


def test_the_discount_rises_between_two_shares_of_the_run():
    seen.clear()
    learner().learn(80, callback=Record(gamma=0.99, begin=0.2, end=0.6))
    middle = round(1 - (0.1 * 0.01) ** 0.5, 4)
    assert seen[:3] == [0.9, 0.9, 0.9] and seen[4] == middle and seen[6:] == [0.99] * 4


def test_a_run_that_goes_on_has_the_discount_of_its_time():
    seen.clear()
    model = learner()
    model.learn(40)
    model.gamma = 0.9  # as built anew from the hyperparameters
    model.learn(40, callback=CallbackList([Record(gamma=0.99)]), reset_num_timesteps=False)
    assert seen[-1] == 0.99 and seen[0] > 0.9


@pytest.mark.parametrize("wrong", [{"gamma": 1.0}, {"gamma": 0.99, "begin": 0.6, "end": 0.6}])
def test_values_out_of_range_are_refused(wrong):
    with pytest.raises(ParameterError):
        RisingDiscount(**wrong)
