"""Whose randomness it is: Gymnasium's ``np_random``, one generator for each episode."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv

from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import SeedError
from defmanip_gym.params import BeamRanges, DisturbanceParams

RANDOM = {
    "beam_ranges": BeamRanges(mass_kg=(0.5, 2.0)),
    "disturbance": DisturbanceParams(force_sensor_noise_n=0.1),
}


def first_steps(env):
    """Return observations and beams of three starts and the steps after them."""
    told = []
    for _ in range(3):
        observation, info = env.reset()
        told += [observation, info["beam_mass_kg"], env.step(env.action_space.sample() * 0)[0]]
    return np.concatenate([np.ravel(part) for part in told])


def test_a_generator_that_a_user_sets_is_obeyed():
    env = DeformTransportEnv(**RANDOM)
    env.reset(seed=0)
    env.np_random = np.random.default_rng(5)
    assert env.np_random_seed == -1
    first = first_steps(env)
    env.reset(seed=5)
    env.np_random = np.random.default_rng(5)
    assert np.array_equal(first_steps(env), first)
    env.np_random = np.random.default_rng(6)
    assert not np.array_equal(first_steps(env), first)


def test_drawing_from_it_changes_what_comes():
    env = DeformTransportEnv(**RANDOM)
    env.np_random = np.random.default_rng(5)
    first = first_steps(env)
    env.np_random = np.random.default_rng(5)
    env.np_random.random()
    assert not np.array_equal(first_steps(env), first)


def test_a_seed_and_gymnasiums_generator_of_that_seed_are_the_same():
    env = DeformTransportEnv(**RANDOM)
    env.reset(seed=7)
    assert env.np_random_seed == 7
    env.reset(seed=7)
    expected = first_steps(env)
    other = DeformTransportEnv(**RANDOM)
    other.np_random = gymnasium.utils.seeding.np_random(7)[0]
    other.reset()
    assert np.array_equal(first_steps(other), expected)


def test_a_batch_has_a_generator_and_a_seed_for_each_episode(make_batch):
    env = make_batch(3, **RANDOM)
    separate = SyncVectorEnv([lambda: DeformTransportEnv(**RANDOM)] * 3)
    for seed in (7, [4, 2, 9]):
        env.reset(seed=seed)
        separate.reset(seed=seed)
        assert env.np_random_seed == separate.np_random_seed
    unseeded = make_batch(2)
    assert len(set(unseeded.np_random_seed)) == 2 and min(unseeded.np_random_seed) >= 0
    for made in (env, separate):
        assert [type(each) for each in made.np_random] == [np.random.Generator] * 3
    env.np_random = [np.random.default_rng(i) for i in (4, 5, 6)]
    assert env.np_random_seed == (-1, -1, -1)
    found, _ = env.reset()
    for row, seed in zip(found, (4, 5, 6), strict=True):
        assert np.array_equal(row, DeformTransportEnv(**RANDOM).reset(seed=seed)[0])


def test_what_is_no_generator_is_refused(make_batch):
    env, batch = gymnasium.make(ENV_ID), make_batch(2)
    one = np.random.default_rng(0)
    for wrong in (None, 3, np.random.RandomState(0)):
        with pytest.raises(SeedError, match="default_rng"):
            env.unwrapped.np_random = wrong
    with pytest.raises(SeedError, match="of its own"):
        batch.unwrapped.np_random = [one, one]
    for wrong in (one, [one], [one, 3], None):
        with pytest.raises(SeedError, match="2 of NumPy's Generators"):
            batch.unwrapped.np_random = wrong
