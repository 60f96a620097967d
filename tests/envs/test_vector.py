"""The batch is the single environment n times, and resets as it declares."""

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from mujoco import batch as mujoco_batch

from defmanip_gym.errors import ActionError, ParameterError, StartError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams
from defmanip_gym.task_params import TaskParams

ENV_ID = "defmanip_gym:DeformTransport-v0"
RANGES = BeamRanges(damping=(0.05, 1.0), mass_kg=(2.5, 3.7))
NOISE = DisturbanceParams(force_bias_n=0.05, force_sensor_noise_n=0.1)


def make(count, **arguments):
    return gymnasium.make_vec(ENV_ID, num_envs=count, **arguments)


def actions(steps, count, size=3):
    return np.random.default_rng(5).uniform(-1, 1, (steps, count, size))


@pytest.mark.parametrize("count", [7, 64])
@pytest.mark.parametrize(("control_mode", "segments"), [("task", 1), ("force", 1), ("task", 9)])
def test_batch_and_single_environment_agree_bit_for_bit(count, control_mode, segments):
    size = 3 if control_mode == "task" else 4
    arguments = {
        "disturbance": NOISE,
        "constraint_mode": "cost",
        "control_mode": control_mode,
        "beam": BeamParams(segment_count=segments),
    }
    many = make(count, autoreset_mode="Disabled", num_threads=2, **arguments)
    single = gymnasium.make(ENV_ID, **arguments)
    observations, _ = many.reset(seed=40)
    index = count // 2
    observation, _ = single.reset(seed=40 + index)
    assert np.array_equal(observations[index], observation)
    for batch in 0.3 * actions(40, count, size):
        observations, rewards, *_ = many.step(batch)
        observation, reward, terminated, *_ = single.step(batch[index])
        assert np.array_equal(observations[index], observation)
        assert rewards[index] == reward
        if terminated:
            break


def test_threads_do_not_change_trajectories():
    one, two = (make(16, num_threads=threads) for threads in (1, 2))
    for env in (one, two):
        env.reset(seed=1)
    for batch in actions(150, 16):
        assert np.array_equal(one.step(batch)[0], two.step(batch)[0])


def test_same_step_reset_hands_over_the_final_observation():
    env = make(4, max_episode_steps=5, autoreset_mode="SameStep")
    reference = make(4, max_episode_steps=5, autoreset_mode="Disabled")
    env.reset(seed=0), reference.reset(seed=0)
    for step in range(5):
        batch = np.full((4, 3), 0.1)
        observation, _, terminated, truncated, info = env.step(batch)
        expected, *_ = reference.step(batch)
        if step < 4:
            assert np.array_equal(observation, expected)
    assert truncated.all() and not terminated.any()
    assert np.array_equal(info["final_obs"], expected)
    assert info["_final_obs"].all()
    assert not np.array_equal(observation, expected)
    assert np.abs(observation[:, 8]).max() == 0.0  # the new episodes start at rest


def test_only_ended_episodes_are_reset():
    env = make(2, constraint_mode="terminate", autoreset_mode="SameStep")
    env.reset(seed=3)
    for _ in range(60):
        observation, _, terminated, _, info = env.step(np.array([[1.0, 0, 0], [0.0, 0, 0]]))
        if terminated.any():
            break
    assert terminated.tolist() == [True, False]
    assert info["final_info"]["cost"].tolist() == [1.0, 0.0]
    assert env.unwrapped.engine.steps.tolist()[0] == 0
    assert env.unwrapped.engine.steps.tolist()[1] > 0


@pytest.mark.parametrize("mode", ["SameStep", "NextStep", "Disabled"])
def test_the_cost_of_an_episode_is_told_at_its_end_in_every_mode(mode):
    arguments = {"constraint_mode": "cost", "sigma_rad": 0.06, "max_episode_steps": 30}
    env = make(2, autoreset_mode=mode, **arguments)
    single = gymnasium.make(ENV_ID, **arguments)
    env.reset(seed=0), single.reset(seed=1)
    total = 0.0
    for _ in range(30):
        *_, truncated, told = env.step(np.full((2, 3), [1.0, 0.0, 0.0]))
        *_, info = single.step(np.array([1.0, 0.0, 0.0]))
        total += info["cost"]
        last = told.get("final_info", told)
        assert info["episode_cost"] == total == last["episode_cost"][1]
        last["episode_cost"][:] = 99.0  # the callers' own
    assert truncated.all() and total > 0 and info["cost"] == 1.0
    if mode == "SameStep":
        assert told["episode_cost"].tolist() == told["cost"].tolist() == [0.0, 0.0]
    if mode == "NextStep":
        *_, told = env.step(np.zeros((2, 3)))
        assert told["episode_cost"].tolist() == [0.0, 0.0]
    assert single.reset()[1]["episode_cost"] == 0.0


def test_next_step_reset_ignores_the_action_after_an_end():
    env = make(3, max_episode_steps=4)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    env.reset(seed=0)
    for _ in range(4):
        *_, truncated, _ = env.step(np.zeros((3, 3)))
    assert truncated.all()
    observation, reward, terminated, truncated, _ = env.step(np.ones((3, 3)))
    assert not terminated.any() and not truncated.any()
    assert (reward == 0).all()
    assert np.abs(observation[:, 5:8]).max() == 0.0
    assert (env.unwrapped.engine.steps == 0).all()


def test_disabled_reset_starts_the_masked_episodes_only():
    env = make(3, autoreset_mode="Disabled")
    env.reset(seed=0)
    before, *_ = env.step(np.full((3, 3), 0.2))
    mask = np.array([True, False, True])
    after, _ = env.reset(options={"reset_mask": mask})
    assert np.array_equal(after[1], before[1])
    assert (after[[0, 2], 8] == 0).all()
    assert env.unwrapped.engine.steps.tolist() == [0, 1, 0]


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_autoreset_continues_each_episodes_own_generator(mode):
    first, second = (make(2, max_episode_steps=2, autoreset_mode=mode) for _ in range(2))
    rows = []
    for env in (first, second):
        env.reset(seed=9)
        rows.append([env.step(np.zeros((2, 3)))[0] for _ in range(5)])
    assert np.array_equal(rows[0], rows[1])
    assert not np.array_equal(rows[0][1], rows[0][4])


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_info_keys_are_the_same_at_reset_and_every_step(mode):
    env = make(2, max_episode_steps=3, autoreset_mode=mode)
    _, info = env.reset(seed=0)
    keys = set(info)
    for _ in range(4):
        *_, info = env.step(np.zeros((2, 3)))
        assert keys == set(info) - {"final_obs", "_final_obs", "final_info", "_final_info"}
        assert all(info[key].shape == (2,) for key in keys)


def test_a_failed_simulation_ends_only_its_own_episode():
    env = make(3, autoreset_mode="Disabled")
    env.reset(seed=0)
    env.unwrapped.engine.simulation._velocity[1] = 1e12
    observation, reward, terminated, _, info = env.step(np.zeros((3, 3)))
    assert terminated.tolist() == [False, True, False]
    assert info["simulation_failed"].tolist() == [False, True, False]
    assert np.isfinite(observation).all() and np.isfinite(reward).all()
    env.reset(options={"reset_mask": np.array([False, True, False])})
    *_, terminated, _, info = env.step(np.zeros((3, 3)))
    assert not terminated.any()


def test_a_failed_simulation_stays_frozen_while_others_are_reset():
    env = make(2, autoreset_mode="Disabled", constraint_mode="cost")
    env.reset(seed=0)
    env.unwrapped.engine.simulation._velocity[1] = np.nan
    *_, info = env.step(np.zeros((2, 3)))
    distance = info["distance_to_goal"][1]
    env.reset(options={"reset_mask": np.array([True, False])})
    _, reward, _, _, info = env.step(np.zeros((2, 3)))
    assert info["distance_to_goal"][1] == distance and reward[1] < 0


class Erring:
    """A batch in which MuJoCo raises an error in one simulation."""

    def __init__(self, inner, index):
        self._inner, self._index = inner, index

    def __getattr__(self, name):
        return getattr(self._inner, name)

    def rollout(self, *args, **kwargs):
        self._inner.rollout(*args, **kwargs)
        raise mujoco_batch.SimulationError(np.array([self._index]), "out of order")


def test_an_error_in_mujoco_ends_only_its_own_episode():
    env, healthy = make(3, autoreset_mode="Disabled"), make(3, autoreset_mode="Disabled")
    env.reset(seed=0), healthy.reset(seed=0)
    simulation = env.unwrapped.engine.simulation
    simulation._batch = Erring(simulation._batch, 1)
    observation, _, terminated, _, info = env.step(np.ones((3, 3)))
    assert terminated.tolist() == info["simulation_failed"].tolist() == [False, True, False]
    assert np.array_equal(observation[[0, 2]], healthy.step(np.ones((3, 3)))[0][[0, 2]])


def test_absurd_velocities_count_as_failed():
    env = make(2, autoreset_mode="Disabled", constraint_mode="cost")
    env.reset(seed=0)
    env.unwrapped.engine.simulation._velocity[1, 4] = 1e6
    observation, *_, info = env.step(np.zeros((2, 3)))
    assert info["simulation_failed"].tolist() == [False, True]
    assert np.abs(observation).max() < 1e3


def test_one_physics_step_per_control_period_reads_the_force_of_that_instant():
    env = make(3, task=TaskParams(control_period_s=0.005))
    env.reset(seed=0)
    observation, *_ = env.step(np.zeros((3, 3)))
    assert np.isfinite(observation).all()


def test_what_callers_do_to_results_does_not_reach_the_episode():
    spoiled, left = (make(2, autoreset_mode="Disabled", beam_ranges=RANGES) for _ in range(2))
    for env in (spoiled, left):
        env.reset(seed=0)
    for batch in actions(20, 2):
        theirs, ours = spoiled.step(batch), left.step(batch)
        assert np.array_equal(theirs[0], ours[0]) and np.array_equal(theirs[1], ours[1])
        for array in (*theirs[:4], *theirs[4].values()):
            array[:] = 0


@pytest.mark.parametrize("steps", [62, 63])
def test_noise_of_the_next_episode_does_not_depend_on_the_reset_mode(steps):
    arguments = {"disturbance": NOISE, "constraint_mode": "cost", "max_episode_steps": steps}
    same, following = (
        make(1, autoreset_mode=mode, **arguments) for mode in ("SameStep", "NextStep")
    )
    for env in (same, following):
        env.reset(seed=0)
    for _ in range(steps):
        observation, *_ = same.step(np.zeros((1, 3)))
        following.step(np.zeros((1, 3)))
    assert np.array_equal(observation, following.step(np.full((1, 3), np.nan))[0])


def test_the_first_reset_must_start_every_episode():
    with pytest.raises(ResetNeeded):
        make(3, autoreset_mode="Disabled").reset(
            seed=0, options={"reset_mask": np.array([True, False, True])}
        )


def test_running_episodes_are_told_their_last_results_again_at_a_partial_reset():
    env = make(3, autoreset_mode="Disabled")
    env.reset(seed=0)
    observation, *_ = env.step(np.ones((3, 3)))
    kept = observation.copy()
    observation[:] = 0.0
    again, _ = env.reset(options={"reset_mask": np.array([True, False, False])})
    assert np.array_equal(again[1:], kept[1:])


def test_actions_are_checked_in_every_step_of_next_step_mode():
    env = make(2, autoreset_mode="NextStep", max_episode_steps=1)
    env.reset(seed=0)
    env.step(np.zeros((2, 3)))
    for bad in (np.zeros(3), np.zeros((1, 3)), [[0, 0, 0], [0]], "left", None):
        with pytest.raises(ActionError):
            env.step(bad)


def test_bad_resets_are_refused_by_name():
    env = make(3, autoreset_mode="Disabled")
    with pytest.raises(ResetNeeded):
        env.step(np.zeros((3, 3)))
    env.reset(seed=0)
    for mask in (np.zeros(3, dtype=bool), np.ones(4, dtype=bool), [1, 0, 2], [[1], 2]):
        with pytest.raises(StartError, match="booleans"):
            env.reset(options={"reset_mask": mask})
    for seed in ([1, 2], -1, 1.5, [1, 2, -3], [1, 2, "x"]):
        with pytest.raises(StartError, match="seed"):
            env.reset(seed=seed)
    for options in ("paper", [1], {1: 2, "a": 3}):
        with pytest.raises(StartError, match="options"):
            env.reset(options=options)
    with pytest.raises(ParameterError, match="autoreset_mode"):
        make(2, autoreset_mode="foo")


@pytest.mark.parametrize(
    ("argument", "value"), [("num_envs", 0), ("max_episode_steps", 0), ("num_threads", -1)]
)
def test_bad_counts_are_refused(argument, value):
    arguments = {"num_envs": 2, argument: value}
    with pytest.raises(ParameterError, match=argument):
        gymnasium.make_vec(ENV_ID, **arguments)
