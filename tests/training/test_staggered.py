import gymnasium
from stable_baselines3 import PPO

from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
from defmanip_gym.training.staggered import StaggeredEpisodes

LIMIT = 40


def learner():
    batch = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v1",
        num_envs=4,
        num_threads=1,
        autoreset_mode="SameStep",
        max_episode_steps=LIMIT,
    )
    return batch, PPO("MlpPolicy", Sb3VecEnv(batch), n_steps=4, batch_size=16, n_epochs=1, seed=0)


def test_first_episodes_end_one_after_another():
    batch, model = learner()
    model.learn(16, callback=StaggeredEpisodes())
    assert batch.unwrapped.engine.steps.tolist() == [4, 14, 24, 34]


def test_learning_that_goes_on_leaves_its_episodes_as_they_are():
    batch, model = learner()
    model.learn(16)
    model.learn(16, callback=StaggeredEpisodes(), reset_num_timesteps=False)
    assert batch.unwrapped.engine.steps.tolist() == [8, 8, 8, 8]
