"""States that do not fit are refused, and leave everything as it was."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

from defmanip_gym import get_state, set_state
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import ParameterError, StateError
from defmanip_gym.params import BeamParams, DisturbanceParams
from defmanip_gym.theory.certificates import certify
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling

NOISY = DisturbanceParams(force_sensor_noise_n=0.1)


def test_a_state_that_does_not_fit_changes_nothing(make_batch):
    env = make_batch(3, disturbance=NOISY)
    env.reset(seed=0)
    own = env.unwrapped.get_state()
    bent = make_batch(3, beam=BeamParams(segment_count=2))
    bent.reset()
    two = make_batch(2)
    two.reset()
    broken = copy.deepcopy(own)
    broken["generators"]["streams"][1]["bit_generator"] = "os.system"
    heavy = own | {"beams": np.full((3, 3), -1.0)}
    for wrong in (
        bent.unwrapped.get_state(),
        two.unwrapped.get_state(),
        broken,
        own | {"noise": 3},
        {key: value for key, value in own.items() if key != "steps"},
        None,
        {},
    ):
        with pytest.raises(StateError):
            env.unwrapped.set_state(wrong)
    with pytest.raises(ParameterError):
        env.unwrapped.set_state(heavy)
    assert pickle.dumps(env.unwrapped.get_state()) == pickle.dumps(own)


def test_wrappers_must_be_the_same():
    bare, wrapped = DeformTransportEnv(), gymnasium.make(ENV_ID)
    bare.reset(seed=0)
    with pytest.raises(StateError, match=r"TimeLimit.*unwrapped"):
        set_state(wrapped, get_state(bare))
    for wrong in (None, {}, {"wrappers": [1], "episodes": 2}):
        with pytest.raises(StateError, match="get_state"):
            set_state(bare, wrong)
    with pytest.raises(StateError, match="a DeformTransport environment"):
        get_state(gymnasium.make("CartPole-v1"))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("is_started",), np.zeros(3)),
        (("starts", "used"), np.full(3, 99)),
        (("noise", "used"), np.full(3, -1)),
    ],
)
def test_damaged_states_change_nothing(path, value, make_batch):
    env = make_batch(3, disturbance=NOISY)
    env.reset(seed=0)
    own = env.unwrapped.get_state()
    damaged = copy.deepcopy(own)
    inner = damaged
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    with pytest.raises(StateError):
        env.unwrapped.set_state(damaged)
    assert pickle.dumps(env.unwrapped.get_state()) == pickle.dumps(own)


def test_damaged_memories_change_nothing():
    env = NuMaxActionScaling(gymnasium.make(ENV_ID), certify(BeamParams()))
    env.reset(seed=0)
    own = get_state(env)
    for layer, memory in ((0, None), (0, {}), (1, {"_elapsed_steps": 3, "more": 1})):
        damaged = copy.deepcopy(own)
        damaged["wrappers"][layer]["memory"] = memory
        with pytest.raises(StateError, match="memory of"):
            set_state(env, damaged)
        assert pickle.dumps(get_state(env)) == pickle.dumps(own)
