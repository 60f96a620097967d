"""Whatever an argument is, the environment works with it or refuses it in its own words."""

from dataclasses import fields
from decimal import Decimal
from fractions import Fraction

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import ActionError, DefmanipError, ParameterError, SeedError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams, LinkParams, RobotParams
from defmanip_gym.task_params import RewardParams, StartParams, TaskParams
from defmanip_gym.theory.certificates import (
    CERTIFICATE_METHODS,
    CertificateConditions,
    ParameterIntervals,
    certify,
)
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling, NuMaxVectorActionScaling

ODD = st.sampled_from(
    [
        *(None, True, "a", b"1", 1j, object(), (), [], {}, float, range(2), lambda: None),
        *(np.True_, np.array(0.02), np.array([0.02]), np.array(None), np.datetime64("2020")),
        *(Fraction(1, 50), Decimal("0.02"), 10**60, 10**400, 10**5000, -(10**5000)),
    ]
)
POWERS = st.builds(
    lambda sign, power: sign * 10.0**power, st.sampled_from((1, -1)), st.integers(-320, 308)
)
USUAL = st.builds(lambda power: 10.0**power, st.integers(-6, 6))
VALUES = st.one_of(USUAL, POWERS, st.floats(), st.integers(-3, 70), st.integers(), ODD)

USES = {
    BeamParams: lambda beam: {"beam": beam},
    RobotParams: lambda robot: {"robot": robot},
    LinkParams: lambda link: {"nominal_robot": RobotParams(forearm=link)},
    TaskParams: lambda task: {"task": task},
    StartParams: lambda start: {"task": TaskParams(start=start)},
    RewardParams: lambda reward: {"task": TaskParams(reward=reward), "constraint_mode": "penalty"},
    DisturbanceParams: lambda disturbance: {"disturbance": disturbance},
    BeamRanges: lambda ranges: {"beam_ranges": ranges},
    TransportConfig: lambda config: {
        field.name: getattr(config, field.name) for field in fields(config)
    },
}
NEEDED = {LinkParams: {"length_m": 0.6, "mass_kg": 4.0}}


@st.composite
def arguments(draw):
    kind = draw(st.sampled_from(list(USES)))
    values = dict(NEEDED.get(kind, {}))
    for name in draw(
        st.sets(st.sampled_from([f.name for f in fields(kind)]), min_size=1, max_size=3)
    ):
        default = getattr(kind(**NEEDED.get(kind, {})), name)
        length = len(default) if isinstance(default, tuple) else 2 if kind is BeamRanges else 0
        several = st.lists(VALUES, min_size=length, max_size=length)
        values[name] = draw(st.one_of(VALUES, several) if length else VALUES)
    return kind, values


@given(arguments(), st.sampled_from(("task", "force")))
def test_any_argument_makes_an_environment_that_works_or_an_error_of_the_package(given, mode):
    kind, values = given
    try:
        env = DeformTransportEnv(**{"control_mode": mode} | USES[kind](kind(**values)))
        env.reset(seed=0)
    except DefmanipError as error:
        assert str(error)
        return
    for action in (1.0, -1.0, 0.0):
        observation, reward, *_ = env.step(np.full(env.action_space.shape, action))
        assert np.isfinite(observation).all()
        assert np.isfinite(reward)


@given(VALUES, st.sampled_from(("num_envs", "max_episode_steps", "num_threads", "sigma_rad")))
def test_any_argument_makes_a_batch_or_an_error_of_the_package(value, name):
    # what is worth checking here are the ends that the arguments have, not thousands of episodes
    is_much = isinstance(value, int | float) and 8 < value < 1e9
    if name in ("num_envs", "num_threads") and is_much:
        return
    try:
        env = DeformTransportVectorEnv(**{"num_envs": 2, "num_threads": 1} | {name: value})
    except DefmanipError as error:
        assert str(error)
        return
    env.reset(seed=0)
    env.step(env.action_space.sample())


@given(VALUES, st.sampled_from(CERTIFICATE_METHODS), st.data())
def test_any_argument_makes_a_certificate_or_an_error_of_the_package(value, method, data):
    kind = data.draw(st.sampled_from((BeamParams, CertificateConditions, ParameterIntervals, None)))
    names = ["sigma_rad"] if kind is None else [field.name for field in fields(kind)]
    if kind is BeamParams:
        names.remove("segment_count")  # many take long, as they may
    arguments = {data.draw(st.sampled_from(names)): value}
    try:
        if kind is BeamParams:
            certificate = certify(BeamParams(**arguments), method=method)
        else:
            name = {CertificateConditions: "conditions", ParameterIntervals: "intervals"}.get(kind)
            options = {name: kind(**arguments)} if kind else arguments
            certificate = certify(BeamParams(), method=method, **options)
    except DefmanipError as error:
        assert str(error)
        return
    assert 0 < certificate.acceleration_bound < np.inf


@pytest.mark.parametrize(
    ("kind", "values", "name"),
    [
        (TaskParams, {"control_period_s": 999999, "physics_period_s": 999999}, "control_period_s"),
        (TaskParams, {"control_period_s": 9.999}, "control_period_s"),
        (TaskParams, {"physics_period_s": 1e-300}, "physics_period_s"),
        (TaskParams, {"goal": (0.0, 0.0, 0.0, 0.0, -1.5, 0.0)}, "task.goal"),
        (BeamParams, {"root_stiffness": 1e308}, "root_stiffness"),
        (BeamParams, {"segment_count": 10**6}, "segment_count"),
    ],
)
def test_numbers_have_an_upper_end_and_steps_a_budget(kind, values, name):
    with pytest.raises(ParameterError) as caught:
        DeformTransportEnv(**USES[kind](kind(**values)))
    assert caught.value.name == name


class Refusing:
    """What arrays of other libraries do that are not to be read."""

    def __array__(self, *args, **kwargs):
        raise RuntimeError("Call detach() first.")


ACTIONS = [
    Refusing(),
    *([10**400, 0, 0], [10**5000, 0, 0], [1e400, 0, 0], [None, 0, 0], [[1], [2, 3], 0], "abc"),
    *(
        ["1", "2", "3"],
        [1j, 0, 0],
        {},
        None,
        5,
        object(),
        [object()] * 3,
        np.zeros(4),
        [np.nan] * 3,
    ),
    *([np.nan] * 3, np.array(["1", "2", "3"]), np.zeros(3, "datetime64[s]"), lambda: None),
]


@pytest.mark.parametrize("wrap", [None, NuMaxActionScaling], ids=["bare", "certified"])
def test_actions_that_are_none_are_refused_and_large_ones_are_clipped(wrap):
    env = gymnasium.make("defmanip_gym:DeformTransport-v0", disable_env_checker=True)
    if wrap is not None:
        env = wrap(env, certify(BeamParams()))
    env.reset(seed=0)
    for action in ACTIONS:
        with pytest.raises(ActionError):
            env.step(action)
    large, _, *_ = env.step([10**60, Fraction(3), Decimal(5)])
    env.reset(seed=0)
    largest, _, *_ = env.step(np.ones(3))
    np.testing.assert_array_equal(large, largest)


@pytest.mark.parametrize("wrap", [None, "delay", "certificate"])
def test_actions_that_are_none_are_refused_for_a_batch(wrap):
    env = DeformTransportVectorEnv(2, num_threads=1)
    if wrap == "delay":
        env = ActionDelay(env, 1)
    elif wrap == "certificate":
        env = NuMaxVectorActionScaling(env, certify(BeamParams()))
    with pytest.raises(ResetNeeded):
        env.step(np.zeros((2, 3)))
    env.reset(seed=0)
    for action in ACTIONS:
        with pytest.raises(ActionError):
            env.step([action, action])
    env.step([[10**60, 0, 0]] * 2)


SEEDS = [-1, np.int64(-1), 1.5, np.float64(2.0), "a", float("nan"), Fraction(2), 1j, np.array([-1])]


@pytest.mark.parametrize("seed", SEEDS, ids=repr)
def test_seeds_that_are_none_give_gymnasiums_own_error(seed):
    single = gymnasium.make("defmanip_gym:DeformTransport-v0")
    batch = DeformTransportVectorEnv(2, num_threads=1)
    for env, given_seed in ((single, seed), (batch, seed), (batch, [seed, 1]), (batch, [0])):
        with pytest.raises(gymnasium.error.Error) as caught:
            env.reset(seed=given_seed)
        assert isinstance(caught.value, SeedError)


def test_seeds_may_be_as_large_as_numpys():
    env = DeformTransportEnv()
    first, _ = env.reset(seed=10**60)
    again, _ = env.reset(seed=10**60)
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("mode", [5, np.array(["task"]), ["task"], {}, np.zeros(3), lambda: None])
@pytest.mark.parametrize("name", ["render_mode", "control_mode", "constraint_mode"])
def test_modes_that_are_none_are_refused(name, mode):
    for kind in (DeformTransportEnv, DeformTransportVectorEnv):
        with pytest.raises(ParameterError, match=name):
            kind(**{name: mode})
