"""What is refused leaves the running episodes as they were."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from defmanip_gym import get_state, set_state
from defmanip_gym.baselines.residual_action import ResidualAction, ResidualVectorAction
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import ActionError, StartError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams
from defmanip_gym.theory.certificates import certify
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling, NuMaxVectorActionScaling

CERTIFICATE = certify(BeamParams())
RANDOM = {
    "beam_ranges": BeamRanges(mass_kg=(0.5, 2.0)),
    "disturbance": DisturbanceParams(force_sensor_noise_n=0.1),
}
FAR, STEEP = (99.0, 0, 0, 1.5, -1.5, 0), (-4.0, 0, 0, 1.5, -1.5, 0.6)
RESETS = (
    {"seed": "seven"},
    {"seed": -1},
    {"seed": 3, "options": {"start": FAR}},
    {"seed": 3, "options": {"start": STEEP}},
    {"seed": 3, "options": {"goal": 1}},
    {"seed": 3, "options": 5},
)
ACTIONS = (np.full(3, np.nan), np.zeros(2), "forward", None)


def kept(env):
    return pickle.dumps(get_state(env))


@pytest.mark.parametrize(
    "wrap",
    [lambda env: env, lambda env: NuMaxActionScaling(env, CERTIFICATE), ResidualAction],
)
def test_a_single_episode_goes_on(wrap):
    env = wrap(DeformTransportEnv(**RANDOM))
    env.reset(seed=0)
    env.step(np.ones(3))
    before = kept(env)
    for arguments in RESETS:
        with pytest.raises(StartError):
            env.reset(**arguments)
        assert kept(env) == before
    for action in ACTIONS:
        with pytest.raises(ActionError):
            env.step(action)
        assert kept(env) == before


@pytest.mark.parametrize(
    "wrap",
    [
        lambda env: env,
        lambda env: NuMaxVectorActionScaling(env, CERTIFICATE),
        lambda env: ActionDelay(env, 2),
        lambda env: ResidualVectorAction(env, decision_periods=2),
    ],
)
def test_the_episodes_of_a_batch_go_on(wrap, make_batch):
    env = wrap(make_batch(3, autoreset_mode="SameStep", **RANDOM))
    env.reset(seed=0)
    env.step(np.ones((3, 3)))
    before = kept(env)
    masks = ([True, False], [1, 0, 0], np.zeros(3, dtype=bool))
    of_batches = (
        {"seed": [3, "four", 5]},
        {"seed": [3, 4]},
        {"seed": 3, "options": {"start": np.array([STEEP] * 3)}},
        *({"seed": 3, "options": {"reset_mask": mask}} for mask in masks),
    )
    for arguments in (*RESETS, *of_batches):
        with pytest.raises(StartError):
            env.reset(**arguments)
        assert kept(env) == before
    for action in ACTIONS:
        with pytest.raises(ActionError):
            env.step([np.zeros(3), np.zeros(3), action])
        assert kept(env) == before


def test_a_first_reset_of_some_starts_none(make_batch):
    env = make_batch(3)
    before = kept(env)
    with pytest.raises(ResetNeeded):
        env.reset(seed=1, options={"reset_mask": np.array([True, False, True])})
    assert kept(env) == before


@pytest.mark.parametrize("arguments", RESETS)
def test_a_state_brings_back_the_count_of_gymnasiums_time_limit(arguments):
    env = gymnasium.make(ENV_ID, max_episode_steps=2)
    env.reset(seed=0)
    env.step(np.zeros(3))
    state = get_state(env)
    with pytest.raises(StartError):
        env.reset(**arguments)
    set_state(env, state)
    assert env.step(np.zeros(3))[3]


@pytest.mark.parametrize("arguments", RESETS)
def test_a_batch_counts_its_steps_on(arguments):
    env = gymnasium.make_vec(ENV_ID, num_envs=1, max_episode_steps=2)
    env.reset(seed=0)
    env.step(np.zeros((1, 3)))
    with pytest.raises(StartError):
        env.reset(**arguments)
    assert env.step(np.zeros((1, 3)))[3].all()
