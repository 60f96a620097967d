"""A controller that brings its filter along asks for what the wrapper would let through."""

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.controller import RandomController
from defmanip_gym.baselines.filtered import FilteredController
from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

ID = "defmanip_gym:DeformTransport-v0"


class Pushing:
    """Swings the object as fast as it can."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        swing_rate = np.atleast_2d(observation)[:, 15]
        action = np.zeros((len(swing_rate), 3))
        action[:, 0] = np.where(swing_rate < 0, 1.0, -1.0)
        return action.reshape(*observation.shape[:-1], 3), state


def batch(**arguments):
    return gymnasium.make_vec(ID, num_envs=3, autoreset_mode="SameStep", **arguments)


def test_it_moves_as_the_controller_inside_the_wrapper():
    alone, around = batch(max_episode_steps=60), batch(max_episode_steps=60)
    safety_filter = filter_for(alone.unwrapped.config)
    wrapped = SafetyFilterVectorWrapper(around, safety_filter)
    controller, state, start = FilteredController(Pushing(), safety_filter), None, None
    seen, _ = alone.reset(seed=1)
    other, _ = wrapped.reset(seed=1)
    intervened = 0
    for _ in range(150):  # over two resets
        actions, state = controller.predict(seen, state, start)
        seen, _, terminated, truncated, _ = alone.step(actions)
        other, *_, info = wrapped.step(Pushing().predict(other)[0])
        intervened += int(info["intervened"].sum())
        start = terminated | truncated
        np.testing.assert_allclose(seen, other, rtol=0, atol=1e-9)
    assert intervened > 50
    alone.close()
    wrapped.close()


def test_one_observation_is_a_batch_of_one():
    env = batch()
    observation, _ = env.reset(seed=2)
    env.close()
    controller = FilteredController(Pushing(), StorageFilter())
    many, _ = controller.predict(observation)
    one, state = controller.predict(observation[1])
    np.testing.assert_array_equal(one, many[1])
    again, _ = controller.predict(observation[1], state)
    assert again.shape == (3,)


def test_a_state_can_be_gone_on_from_twice():
    env = batch()
    observation, _ = env.reset(seed=3)
    controller = FilteredController(Pushing(), StorageFilter())
    actions, state = controller.predict(observation)
    following, *_ = env.step(actions)
    env.close()
    first, _ = controller.predict(following, state)
    second, _ = controller.predict(following, state)
    np.testing.assert_array_equal(first, second)


def test_the_controllers_own_state_goes_on_below():
    controller = FilteredController(RandomController(0), StorageFilter())
    observation = np.zeros((2, 22))
    observation[:, 4] = 1.0
    observation[:, 10:12] = np.pi / 2, -np.pi / 2
    _, state = controller.predict(observation)
    assert state is not None and len(state) == 2


@pytest.mark.parametrize("starts", [np.array([True]), np.array([1, 0, 1]), [True, False, True]])
def test_starts_are_one_for_all_or_one_for_each(starts):
    env = batch()
    observation, _ = env.reset(seed=4)
    env.close()
    controller = FilteredController(Pushing(), StorageFilter())
    first, state = controller.predict(observation)
    again, _ = controller.predict(observation, state, starts)
    np.testing.assert_array_equal(again[0], first[0])
    with pytest.raises(ParameterError, match="episode_start"):
        controller.predict(observation, state, np.array([True, False]))
