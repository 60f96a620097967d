"""Late actuators: what arrives when, also across the ends of episodes."""

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from defmanip_gym.envs.state import get_state, set_state
from defmanip_gym.errors import ActionError, ParameterError, StateError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

ENV_ID = "defmanip_gym:DeformTransport-v0"


class Arriving(gymnasium.vector.VectorWrapper):
    """Keeps what arrives at the environment."""

    def __init__(self, env):
        super().__init__(env)
        self.actions = []

    def step(self, actions):
        self.actions.append(np.array(actions)[:, 0])
        return self.env.step(actions)


def delayed(periods, mode="Disabled", count=2, **arguments):
    env = gymnasium.make_vec(
        ENV_ID, num_envs=count, autoreset_mode=mode, constraint_mode="cost", **arguments
    )
    arriving = Arriving(env)
    return ActionDelay(arriving, periods), arriving


def send(env, *values):
    for value in values:
        env.step(np.tile(np.reshape(value, (-1, 1)), (env.num_envs // np.size(value), 3)))


@pytest.mark.parametrize("periods", [0, 1, 3])
def test_actions_arrive_that_many_periods_later_and_zeros_before(periods):
    env, arriving = delayed(periods)
    env.reset(seed=0)
    send(env, 0.1, 0.2, 0.3, 0.4)
    expected = ([0.0] * periods + [0.1, 0.2, 0.3, 0.4])[:4]
    np.testing.assert_array_equal(np.array(arriving.actions)[:, 0], expected)


def test_an_episode_that_is_reset_begins_with_nothing_on_its_way_and_the_others_go_on():
    env, arriving = delayed(2)
    env.reset(seed=0)
    send(env, 0.1, 0.2)
    env.reset(options={"reset_mask": np.array([True, False])})
    send(env, 0.3, 0.4, 0.5)
    np.testing.assert_array_equal(np.array(arriving.actions)[2:, 0], [0.0, 0.0, 0.3])
    np.testing.assert_array_equal(np.array(arriving.actions)[2:, 1], [0.1, 0.2, 0.3])


def test_episodes_reset_within_a_step_begin_with_nothing_on_their_way():
    env, arriving = delayed(1, "SameStep", max_episode_steps=3)
    env.reset(seed=0)
    send(env, 0.1, 0.2, 0.3, 0.4, 0.5)  # the third step ends the first episodes
    np.testing.assert_array_equal(np.array(arriving.actions)[:, 0], [0.0, 0.1, 0.2, 0.0, 0.4])


def test_the_ignored_action_of_next_step_mode_never_arrives():
    env, arriving = delayed(1, "NextStep", max_episode_steps=3)
    env.reset(seed=0)
    send(env, 0.1, 0.2, 0.3, np.nan, 0.5, 0.6)  # the fourth is ignored
    arrived = np.array(arriving.actions)[[0, 1, 2, 4, 5], 0]
    np.testing.assert_array_equal(arrived, [0.0, 0.1, 0.2, 0.0, 0.5])


def test_a_certificate_around_it_bounds_what_arrives():
    certificate = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)
    env, arriving = delayed(3)
    wrapped = NuMaxVectorActionScaling(env, certificate)
    wrapped.reset(seed=0)
    for _ in range(4):
        wrapped.step(np.tile((1.0, 0.0, 0.0), (2, 1)))
    share = certificate.acceleration_bound / 3.0
    np.testing.assert_allclose(np.array(arriving.actions)[:, 0], [0, 0, 0, share])


def test_what_callers_do_to_their_actions_afterwards_does_not_matter():
    env, arriving = delayed(1)
    env.reset(seed=0)
    actions = np.full((2, 3), 0.1)
    env.step(actions)
    actions[:] = 0.9
    env.step(actions)
    assert arriving.actions[1][0] == 0.1


def test_bad_actions_are_refused_at_once():
    env, _ = delayed(3)
    with pytest.raises(ResetNeeded):
        env.step(np.zeros((2, 3)))
    env.reset(seed=0)
    for actions in (np.zeros((2, 2)), np.full((2, 3), np.nan), "abc"):
        with pytest.raises(ActionError):
            env.step(actions)


@pytest.mark.parametrize("periods", [-1, 1.5, None, np.array(1.5), "ab", (1, 2, 3)])
def test_impossible_delays_are_refused(periods):
    with pytest.raises(ParameterError, match="periods"):
        delayed(periods)


def test_episodes_may_each_be_late_by_their_own():
    env, arriving = delayed((0, 3), "SameStep", count=8, max_episode_steps=6)
    env.reset(seed=0)
    delays = env.delays
    assert env.is_drawn and set(delays) <= {0, 1, 2, 3} and len(set(delays)) > 1
    send(env, *(0.1 * step for step in range(1, 6)))
    expected = 0.1 * np.maximum(np.arange(1, 6)[:, None] - delays, 0)
    np.testing.assert_allclose(np.array(arriving.actions), expected)
    send(env, 0.0)  # all are cut, and draw anew
    assert (env.delays != delays).any()


def test_drawn_delays_are_the_seeds_and_filters_do_not_cover_them():
    many, few = delayed((1, 3), count=4)[0], delayed((1, 3), count=2)[0]
    many.reset(seed=[1, 2, 3, 4])
    few.reset(seed=[3, 4])
    np.testing.assert_array_equal(many.delays[2:], few.delays)
    env = ActionDelay(gymnasium.make_vec(ENV_ID, num_envs=2), (1, 3))
    filtered = SafetyFilterVectorWrapper(env, filter_for(env.unwrapped.config))
    _, info = filtered.reset(seed=0)
    assert not info["filter_applies"].any() and "ActionDelay" in info["filter_reason"][0]
    with pytest.raises(ParameterError, match="periods"):
        ActionDelay(few, (3, 1))


def test_states_of_wrappers_that_are_late_otherwise_are_refused():
    drawn, fixed, later = (delayed(periods, count=8)[0] for periods in ((0, 3), 3, 4))
    for env in (drawn, fixed, later):
        env.reset(seed=0)
    for given, taken in ((drawn, fixed), (later, fixed), (fixed, later)):
        before = taken.delays
        with pytest.raises(StateError, match="delays"):
            set_state(taken, get_state(given))
        np.testing.assert_array_equal(taken.delays, before)
    set_state(drawn, get_state(fixed))  # it may be as late in all
    np.testing.assert_array_equal(drawn.delays, 3)
