"""What ``metadata`` says of render modes: Gymnasium's list, which refuses what is no name."""

import copy
import json
import pickle

import gymnasium
import numpy as np
import pytest

from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import ParameterError

NAMES = ["human", "rgb_array", "depth_array"]
MODES = DeformTransportEnv.metadata["render_modes"]


@pytest.mark.parametrize("mode", [5, np.zeros(3), ["human"], b"human", {}])
def test_gymnasium_refuses_what_is_no_name_in_our_words(mode):
    for vectorization in ({"vectorization_mode": "sync"}, {"vectorization_mode": "async"}, {}):
        with pytest.raises(ParameterError, match="render_mode"):
            gymnasium.make_vec(ENV_ID, num_envs=1, render_mode=mode, **vectorization)
    with pytest.raises(ParameterError, match="render_mode.*'rgb_array'"):
        gymnasium.make(ENV_ID, render_mode=mode)


@pytest.mark.parametrize("name", ["ascii", "human_lis", "ascii_list"])
def test_unknown_names_are_refused_after_gymnasiums_warning(name):
    with pytest.raises(ParameterError, match="render_mode"), pytest.warns(match=name):
        gymnasium.make(ENV_ID, render_mode=name)


@pytest.mark.parametrize("name", ["rgb_array", "depth_array"])
def test_gymnasium_collects_images(name):
    env = gymnasium.make(ENV_ID, render_mode=f"{name}_list")
    assert isinstance(env, gymnasium.wrappers.RenderCollection)
    assert env.unwrapped.render_mode == name
    assert f"{name}_list" in env.metadata["render_modes"]
    assert MODES == NAMES


def test_modes_are_a_list_as_any():
    assert MODES == NAMES
    assert json.loads(json.dumps(MODES)) == NAMES
    assert {"rgb_array", "rgb_array_list"}.intersection(MODES) == {"rgb_array"}
    assert all(name in MODES for name in NAMES)
    assert None not in MODES


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))]
)
def test_copies_refuse_too(copied):
    assert copied(MODES) == NAMES
    with pytest.raises(ParameterError):
        assert 5 not in copied(MODES)
