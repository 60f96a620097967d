"""SB3 sees the batch as it expects environments to be."""

import doctest

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    VecCheckNan,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)
from stable_baselines3.common.vec_env.base_vec_env import VecEnvWrapper

from defmanip_gym.errors import ParameterError, StartError
from defmanip_gym.training import sb3_vec_env
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv

ENV_ID = "defmanip_gym:DeformTransport-v0"
START = (-3.0, 1.0, 0.0, np.pi / 3, -np.pi / 2, 0.0)


def batch(count, autoreset_mode="SameStep", **arguments):
    return gymnasium.make_vec(ENV_ID, num_envs=count, autoreset_mode=autoreset_mode, **arguments)


def make(count=3, **arguments):
    venv = Sb3VecEnv(batch(count, **arguments))
    venv.seed(0)
    return venv


def steps(venv, count, action=0.1):
    """Return the last of ``count`` steps."""
    for _ in range(count):
        result = venv.step(np.full((venv.num_envs, 3), action))
    return result


def test_truncation_is_marked_and_the_final_observation_handed_over():
    venv, plain = make(max_episode_steps=4), make(max_episode_steps=9)
    for env in (venv, plain):
        env.seed(5)
        env.reset()
    observation, _, done, infos = steps(venv, 4)
    expected, *_ = steps(plain, 4)
    assert done.all()
    for index, info in enumerate(infos):
        assert info["TimeLimit.truncated"] is True
        assert np.array_equal(info["terminal_observation"], expected[index])
        assert info["episode"]["l"] == 4
    assert not np.array_equal(observation, expected)


def test_termination_is_not_marked_as_truncation():
    venv = make(1)
    venv.reset()
    for _ in range(80):
        *_, done, infos = venv.step(np.array([[1.0, 0.0, 0.0]]))
        if done[0]:
            break
    assert infos[0]["TimeLimit.truncated"] is False
    assert infos[0]["episode"]["cost"] == 1.0


def test_episode_return_is_the_sum_of_rewards():
    venv = make(1, max_episode_steps=6)
    venv.reset()
    rewards = [venv.step(np.zeros((1, 3)))[1][0] for _ in range(5)]
    _, reward, _, infos = venv.step(np.zeros((1, 3)))
    assert infos[0]["episode"]["r"] == pytest.approx(sum(rewards) + reward[0], rel=1e-5)


def test_costs_are_those_of_the_episode_itself():
    venv = make(2, max_episode_steps=20, constraint_mode="cost", sigma_rad=0.06)
    venv.reset()
    costs = np.zeros(2)
    for _ in range(19):
        steps(venv, 1, 1.0)
        costs += venv.step_info["cost"]
    *_, infos = steps(venv, 1, 1.0)
    assert [info["episode"]["cost"] for info in infos] == [
        total + info["cost"] for total, info in zip(costs, infos, strict=True)
    ]
    assert costs.sum() > 0


def test_seeds_reach_the_episodes_and_are_used_once():
    first, second = make(), make()
    assert first.seed(3) == [3, 4, 5] == second.seed(3)
    assert np.array_equal(first.reset(), second.reset())
    assert np.array_equal(first.reset(), second.reset())  # goes on with the same generators
    second.seed(3)
    assert not np.array_equal(first.reset(), second.reset())


def test_options_reach_the_next_reset_only():
    venv, expected = make(), make()
    venv.set_options({"start": START})
    given = venv.reset()  # draws nothing
    assert np.array_equal(given[0], given[2])
    assert np.array_equal(venv.reset(), expected.reset())


def test_every_episode_can_have_options_of_its_own():
    venv = make()
    moved = [{"start": (x, *START[1:])} for x in (-3.0, -4.0, -5.0)]
    venv.set_options(moved)
    observations = venv.reset()
    for options, observation in zip(moved, observations, strict=True):
        venv.set_options(options)
        assert np.array_equal(venv.reset()[0], observation)
    venv.set_options([{"start": "paper"} for _ in range(3)])
    assert np.array_equal(*venv.reset()[:2])


def test_options_that_a_batch_cannot_take_are_refused():
    venv = make()
    venv.set_options([{"start": START}, {}, {}])
    with pytest.raises(StartError, match="every 'start'"):
        venv.reset()


def test_reset_infos_are_those_of_the_last_start_of_each_episode():
    venv = make(2, max_episode_steps=3)
    venv.seed(1)
    venv.reset()
    assert venv.reset_infos[1]["distance_to_goal"] == venv.step_info["distance_to_goal"][1]
    *_, infos = steps(venv, 3)
    for reset_info, now, ended in zip(
        venv.reset_infos, venv.step_info["distance_to_goal"], infos, strict=True
    ):
        assert reset_info["distance_to_goal"] == now != ended["distance_to_goal"]
        assert type(reset_info["is_success"]) is bool


def test_results_of_a_step_outlive_the_following_ones():
    venv = make(max_episode_steps=2)
    venv.reset()
    results = steps(venv, 2)
    before = [part.copy() for part in results[:3]], results[3][0]["terminal_observation"].copy()
    steps(venv, 3, 1.0)
    for part, expected in zip(results[:3], before[0], strict=True):
        assert np.array_equal(part, expected)
    assert np.array_equal(results[3][0]["terminal_observation"], before[1])


class Stamping(VecEnvWrapper):
    """Writes the number of the step into every info, but for the second."""

    count = 0

    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        *rest, infos = self.venv.step_wait()
        self.count += 1
        for info in infos if self.count != 2 else ():
            assert "stamp" not in info
            info["stamp"] = self.count
        return *rest, infos


def test_wrappers_may_write_into_the_infos():
    venv = Stamping(make(max_episode_steps=4))
    venv.reset()
    infos = [steps(venv, 1)[3] for _ in range(5)]
    assert [step[1].get("stamp") for step in infos] == [1, None, 3, 4, 5]


def test_vec_monitor_logs_what_the_episodes_report(tmp_path):
    with pytest.warns(UserWarning, match="already wrapped"):
        venv = VecMonitor(
            make(max_episode_steps=3), str(tmp_path / "log"), ("is_success", "distance_to_goal")
        )
    inner = make(max_episode_steps=3)
    for env in (venv, inner):
        env.seed(2)
        env.reset()
    monitored, own = steps(venv, 3)[3], steps(inner, 3)[3]
    venv.close()
    assert monitored[0]["episode"]["r"] == pytest.approx(own[0]["episode"]["r"], rel=1e-5)
    log = (tmp_path / "log.monitor.csv").read_text()
    assert "DeformTransport-v0" in log and "distance_to_goal" in log


def test_vec_normalize_and_vec_check_nan_work_on_it():
    venv = VecCheckNan(VecNormalize(make(max_episode_steps=4)), raise_exception=True)
    venv.reset()
    observation, reward, done, infos = steps(venv, 4)
    assert observation.dtype == reward.dtype == np.float32
    assert done.all()
    normalize = venv.venv
    for info in infos:
        assert np.abs(info["terminal_observation"]).max() <= normalize.clip_obs
    assert "cost" in venv.step_info  # SB3's wrappers hand attributes through
    with pytest.raises(ValueError, match="nan in actions"):
        steps(venv, 1, np.nan)


@pytest.mark.parametrize("wrapper", [lambda env: env, VecNormalize])
def test_off_policy_training_stores_final_observations(wrapper):
    venv = wrapper(make(4, max_episode_steps=20))
    model = SAC(
        "MlpPolicy",
        venv,
        learning_starts=40,
        train_freq=10,
        seed=0,
        policy_kwargs={"net_arch": [8]},
    )
    model.learn(320)
    buffer = model.replay_buffer
    assert buffer.pos == 80
    assert buffer.timeouts[19].all() and buffer.dones[19].all()
    assert np.allclose(buffer.next_observations[5], buffer.observations[6])
    assert not np.allclose(buffer.next_observations[19], buffer.observations[20])
    assert [info["l"] for info in model.ep_info_buffer] == [20] * 16
    assert len(model.ep_success_buffer) == 16


class Still:
    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.zeros((len(observation), 3)), state


def test_evaluate_policy_reads_the_statistics_of_the_episodes(recwarn):
    venv = make(3, max_episode_steps=6)
    venv.seed(0)
    returns, lengths = evaluate_policy(Still(), venv, 7, return_episode_rewards=True)
    assert lengths == [6] * 7
    assert len(set(returns)) == 7
    assert not [warning for warning in recwarn.list if "out of date" not in str(warning.message)]


def test_attributes_and_wrappers_are_those_of_the_batch():
    inner = batch(2, render_mode="rgb_array")
    venv = Sb3VecEnv(gymnasium.wrappers.vector.ClipAction(inner))
    assert venv.render_mode == "rgb_array"
    assert venv.metadata["render_fps"] == 50
    assert [spec.id for spec in venv.get_attr("spec")] == ["DeformTransport-v0"] * 2
    assert venv.get_attr("config", 1) == [inner.config]
    assert venv.has_attr("sigma_rad") is False
    assert venv.env_is_wrapped(Monitor) == [True, True]
    assert venv.env_is_wrapped(gymnasium.wrappers.vector.ClipAction, [0]) == [True]
    assert venv.env_is_wrapped(gymnasium.wrappers.vector.ClipReward) == [False, False]


@pytest.mark.usefixtures("opengl")
def test_images_are_those_of_the_index():
    inner = batch(2, width=32, height=24, render_mode="rgb_array")
    venv = Sb3VecEnv(inner)
    venv.seed(0)
    venv.reset()
    for images in (venv.env_method("render_camera", "side"), venv.env_method("render")):
        assert [image.shape for image in images] == [(24, 32, 3)] * 2
        assert not np.array_equal(*images)
    np.testing.assert_array_equal(venv.get_images(), images)


def test_methods_and_attributes_of_the_batch_can_be_reached_and_set():
    inner = batch(2)
    venv = Sb3VecEnv(gymnasium.wrappers.vector.RecordEpisodeStatistics(inner))
    for name in ("config", "episode_count", "spec"):  # the batch's, the wrapper's, both have it
        assert venv.env_method("get_wrapper_attr", name) == venv.get_attr(name)
        assert venv.env_method("has_wrapper_attr", name, indices=[1]) == [True]
    assert venv.env_method("has_wrapper_attr", "nothing") == [False, False]
    with pytest.raises(AttributeError):
        venv.env_method("get_wrapper_attr", "nothing")
    venv.set_attr("episode_count", 7)
    assert venv.env.episode_count == 7
    venv.env_method("set_wrapper_attr", "max_episode_steps", 9, indices=[0, -1])
    assert inner.max_episode_steps == 9
    venv.set_attr("note", "new")
    assert venv.env.note == "new" and venv.has_attr("note") and not hasattr(inner, "note")
    assert venv.env_method("set_wrapper_attr", "other", 1, force=False) == [False, False]
    assert not venv.has_attr("other")


def test_spaces_of_an_index_are_those_of_one_episode():
    venv = make(3)
    assert venv.get_attr("action_space", [1]) == [venv.action_space]
    assert venv.get_attr("observation_space") == [venv.observation_space] * 3


def test_what_would_change_some_episodes_only_is_refused():
    venv = make(3)
    for indices in (0, [0, 1], [-1]):
        with pytest.raises(ParameterError, match="whole batch"):
            venv.set_attr("note", 1, indices)
    for name in ("reset", "step", "close"):
        with pytest.raises(ParameterError, match="Sb3VecEnv"):
            venv.env_method(name)


def test_frames_are_stacked_and_attributes_found_through_sb3s_wrappers():
    venv = VecFrameStack(make(2, max_episode_steps=3), n_stack=2)
    size = venv.venv.observation_space.shape[0]
    venv.reset()
    *_, infos = steps(venv, 3)
    assert infos[0]["terminal_observation"].shape == (2 * size,)
    assert venv.getattr_depth_check("step_info", already_found=False) is None
    assert venv.step_info["cost"].shape == (2,)
    assert venv.env_method("get_wrapper_attr", "max_episode_steps") == [3, 3]


def test_eval_callback_evaluates_on_it(tmp_path):
    model = PPO("MlpPolicy", make(2, max_episode_steps=4), n_steps=8, batch_size=16, n_epochs=1)
    callback = EvalCallback(
        make(2, max_episode_steps=4), n_eval_episodes=3, eval_freq=4, log_path=str(tmp_path)
    )
    model.learn(16, callback=callback)
    lengths = np.load(tmp_path / "evaluations.npz")["ep_lengths"]
    assert lengths.shape == (2, 3) and (lengths == 4).all()


def test_other_reset_modes_are_refused_with_what_to_write():
    for arguments in ({"autoreset_mode": "NextStep"}, {"autoreset_mode": "Disabled"}):
        with pytest.raises(ParameterError, match="autoreset_mode='SameStep'"):
            make(**arguments)
    with pytest.raises(ParameterError, match="SAME_STEP"):
        Sb3VecEnv(gymnasium.make_vec(ENV_ID, num_envs=1))


def test_the_example_in_the_documentation_runs():
    assert doctest.testmod(sb3_vec_env).failed == 0
