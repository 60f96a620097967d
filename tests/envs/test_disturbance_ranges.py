"""Episodes may each draw what disturbs them."""

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.disturbance_ranges import DisturbanceRanges
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.evaluation.rollout import courses
from defmanip_gym.params import BeamParams, DisturbanceParams
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.filter_errors import filter_errors
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

RANGES = DisturbanceRanges(
    force_amplitude_n=(0.5, 2.0),
    force_frequency_rad_s=(1.0, 6.0),
    force_bias_n=(-2.0, 1.0),
    force_sensor_noise_n=(0.0, 0.5),
    swing_sensor_noise_rad=(0.0, 0.02),
)


def batch(count, **arguments):
    arguments = {"disturbance_ranges": RANGES, "autoreset_mode": "SameStep"} | arguments
    return gymnasium.make_vec(ENV_ID, num_envs=count, **arguments)


def trajectory(env, seed, steps=25):
    observations = [env.reset(seed=seed)[0].copy()]
    for step in range(steps):
        actions = np.full((env.num_envs, 3), 0.3 * np.sin(step))
        observations.append(env.step(actions)[0].copy())
    return np.array(observations)


def drawn(env):
    return env.unwrapped.engine._disturbances.get_state()


def test_each_episode_has_its_own_and_the_next_another():
    env = batch(4, max_episode_steps=2)
    env.reset(seed=0)
    first = drawn(env)
    assert len(np.unique(first, axis=0)) == 4
    for values, name in zip(first.T, RANGES.__dataclass_fields__, strict=True):
        low, high = getattr(RANGES, name)
        assert ((values >= low) & (values <= high)).all()
    for _ in range(2):
        env.step(np.zeros((4, 3)))
    assert not (drawn(env) == first).any()


def test_an_episode_does_not_depend_on_its_batch():
    together, alone = batch(3), batch(1)
    seeds = [5, 6, 7]
    np.testing.assert_array_equal(trajectory(together, seeds)[:, 1], trajectory(alone, [6])[:, 0])


def test_it_moves_as_with_the_same_disturbance_for_all():
    ranges = DisturbanceRanges(force_amplitude_n=(0.5, 2.0), force_bias_n=(-2.0, 1.0))
    env = batch(1, disturbance_ranges=ranges)
    moved = trajectory(env, [3])
    names = DisturbanceParams.__dataclass_fields__
    same = DisturbanceParams(**dict(zip(names, drawn(env)[0].tolist(), strict=True)))
    other = batch(1, disturbance=same, disturbance_ranges=DisturbanceRanges())
    start = moved[0]
    found = trajectory(other, [3])
    np.testing.assert_array_equal(found[0], start)
    np.testing.assert_array_equal(found, moved)


def test_a_state_holds_them():
    env, other = batch(2), batch(2)
    trajectory(env, [1, 2])
    other.reset(seed=9)
    other.unwrapped.set_state(env.unwrapped.get_state())
    for _ in range(5):
        actions = np.full((2, 3), 0.2)
        np.testing.assert_array_equal(env.step(actions)[0], other.step(actions)[0])


def test_a_state_without_goes_on_with_what_is_given():
    plain, ranged = batch(2, disturbance_ranges=DisturbanceRanges()), batch(2)
    plain.reset(seed=1)
    ranged.reset(seed=1)
    ranged.unwrapped.set_state(plain.unwrapped.get_state())
    assert drawn(ranged) is None


def test_specifications_hold_them():
    env = gymnasium.make(ENV_ID, disturbance_ranges=RANGES)
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config


def test_filters_provide_for_the_largest():
    env = batch(2)
    enough = filter_for(env.unwrapped.config)
    assert enough.conditions.swing_noise_rad == 0.02
    wrapped = SafetyFilterVectorWrapper(env, enough)
    _, info = wrapped.reset(seed=0)
    assert info["filter_applies"].all()
    less = filter_for(batch(1, disturbance_ranges=DisturbanceRanges()).unwrapped.config)
    _, info = SafetyFilterVectorWrapper(batch(2), less).reset(seed=0)
    assert not info["filter_applies"].any() and "noise" in info["filter_reason"][0]


@pytest.mark.parametrize(
    "wrong",
    [
        {"force_bias_n": (1.0, -1.0)},
        {"swing_sensor_noise_rad": (-0.1, 0.1)},
        {"force_amplitude_n": 3.0},
        {"force_sensor_noise_n": (0.0, 1e7)},
        {"force_sensor_noise_n": (0.0, float("nan"))},
    ],
)
def test_ranges_that_are_none_are_refused(wrong):
    with pytest.raises(ParameterError):
        DisturbanceRanges(**wrong)


def test_filters_provide_for_frequencies_that_samples_would_not_show():
    unseen = math.tau / TransportConfig().task.control_period_s  # zero at all of them
    (worst,) = DisturbanceRanges(force_frequency_rad_s=(0.0, unseen)).worst(
        DisturbanceParams(force_amplitude_n=30.0), TransportConfig().task.control_period_s
    )
    assert worst.force_frequency_rad_s == pytest.approx(0.5 * unseen, rel=1e-2)
    assert worst.force_frequency_rad_s != pytest.approx(0.5 * unseen, rel=1e-6)
    config = TransportConfig(
        disturbance=DisturbanceParams(force_amplitude_n=30.0),
        disturbance_ranges=DisturbanceRanges(force_frequency_rad_s=(0.0, unseen)),
    )
    with pytest.raises(CertificateError):
        filter_for(config)


def test_filters_provide_for_a_bias_of_either_sign():
    heavier = replace(BeamParams(), mass_kg=1.1 * BeamParams().mass_kg)  # is what robots believe

    def errors(**arguments):
        return filter_errors(
            TransportConfig(payload=RodPayload(nominal_beam=heavier), **arguments), StorageFilter()
        )

    one_way, other_way = (
        errors(disturbance=DisturbanceParams(force_bias_n=bias)) for bias in (-2.0, 1.9)
    )
    both = errors(disturbance_ranges=DisturbanceRanges(force_bias_n=(-2.0, 1.9)))
    assert both.offset_m_s2 == tuple(
        map(max, zip(one_way.offset_m_s2, other_way.offset_m_s2, strict=True))
    )
    assert one_way.offset_m_s2 != both.offset_m_s2 != other_way.offset_m_s2


def test_rollouts_draw_them():
    config = TransportConfig(disturbance_ranges=DisturbanceRanges(force_bias_n=(20.0, 20.0)))
    pushed, left = (
        courses(ZeroController(), [1], config=each, steps=2) for each in (config, TransportConfig())
    )
    assert not np.array_equal(pushed[0].observation, left[0].observation)
