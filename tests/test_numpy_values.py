"""NumPy's numbers and arrays are numbers and sequences; what is kept of them is Python's own."""

import json
from dataclasses import asdict, fields
from decimal import Decimal
from fractions import Fraction

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic.tanner import TannerParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.conditions import Condition
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.params import (
    BeamParams,
    BeamRanges,
    DisturbanceParams,
    LinkParams,
    RobotParams,
)
from defmanip_gym.reproduction.config import ReproductionConfig
from defmanip_gym.task_params import RewardParams, StartParams, TaskParams
from defmanip_gym.theory.certificates import CertificateConditions, ParameterIntervals
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.velocity_field import LiteralField, NormalizedField
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.tune_config import TuneConfig
from defmanip_gym.wrappers.action_delay import ActionDelay

EXAMPLES = [
    LinkParams(length_m=0.5, mass_kg=2.0),
    RobotParams(),
    BeamParams(segment_count=2),
    BeamRanges(damping=(0.1, 1.0), mass_kg=(1.0, 2.0)),
    DisturbanceParams(force_bias_n=1.0),
    RewardParams(),
    StartParams(),
    TaskParams(),
    CertificateConditions(yaw_rate_rad_s=0.5),
    ParameterIntervals(damping=(0.5, 2.0)),
    TransportConfig(sigma_rad=0.5),
    TannerParams(),
    ForceLoopGains(),
    LiteralField(),
    NormalizedField(max_speed_m_s=1.0, deceleration_m_s2=1.0, vertical_deceleration_m_s2=1.0),
    Condition(name="late", actuation_delay_s=0.04),
    ComparisonConfig(episodes=3, members=2, jobs=1),
    ReproductionConfig(),
    TrainConfig(seed=3, total_timesteps=100),
    TuneConfig(),
]


def with_numpy(value, whole, real):
    if isinstance(value, bool):
        return np.bool_(value)
    if isinstance(value, int):
        return whole(value)
    if isinstance(value, float):
        return real(value)
    if isinstance(value, tuple) and value:
        return np.array(value)
    return value


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: type(example).__name__)
@pytest.mark.parametrize(
    ("whole", "real"), [(np.int32, np.float64), (np.uint64, np.longdouble), (np.array, np.array)]
)
def test_parameters_made_of_numpys_values_are_those_of_pythons(example, whole, real):
    values = {field.name: getattr(example, field.name) for field in fields(example)}
    made = type(example)(**{name: with_numpy(value, whole, real) for name, value in values.items()})
    assert made == example
    assert hash(made) == hash(example)
    assert json.dumps(asdict(made), default=str) == json.dumps(asdict(example), default=str)
    assert type(example)(**values) == example


def test_whole_numbers_and_fractions_count_as_real():
    beam = BeamParams(mass_kg=Fraction(5, 2), damping=np.float32(0.5), length_m=1)
    assert (beam.mass_kg, beam.damping, beam.length_m) == (2.5, 0.5, 1.0)
    assert {type(value) for value in (beam.mass_kg, beam.damping, beam.length_m)} == {float}
    assert TaskParams(goal=[0, 0, 0, np.pi / 2, -np.pi / 2, 0]) == TaskParams()


class Tensor:
    """A scalar of another library."""

    ndim = 0

    def item(self):
        return 0.5


def test_scalars_of_other_libraries_are_numbers():
    assert BeamParams(damping=Tensor()).damping == 0.5


@pytest.mark.parametrize(
    "bad",
    [
        *(True, np.True_, np.array(True), np.array([0.5]), np.array([[0.5]]), [0.5], "0.5"),
        *(Decimal("0.5"), 0.5 + 0j, np.complex128(0.5), np.datetime64("2020"), np.array(None)),
        *(10**400, 10**5000, float, object()),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_real_number_is_refused(bad):
    with pytest.raises(ParameterError, match="damping"):
        BeamParams(damping=bad)


@pytest.mark.parametrize("bad", [2.0, np.float64(2.0), np.True_, np.array([2]), Fraction(2), "2"])
def test_what_is_no_whole_number_is_refused(bad):
    with pytest.raises(ParameterError, match="segment_count"):
        BeamParams(segment_count=bad)


@pytest.mark.parametrize(
    "bad", [np.zeros((6, 1)), np.zeros(5), np.array(0.0), {0.0: 1}, "000000", [True] * 6, None]
)
def test_what_is_no_sequence_of_numbers_is_refused(bad):
    with pytest.raises(ParameterError, match="goal"):
        TaskParams(goal=bad)


def test_environments_take_numpys_numbers():
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=np.int64(3),
        num_threads=np.int8(1),
        max_episode_steps=np.uint32(5),
        sigma_rad=np.float64(0.5),
        beam=BeamParams(segment_count=np.int64(2)),
    )
    first, _ = env.reset(seed=np.int64(3))
    again, _ = env.reset(seed=np.array([3, 4, 5]))
    np.testing.assert_array_equal(first, again)
    assert env.observation_space.shape == (3, 24)
    delayed = ActionDelay(env, np.int64(2))
    delayed.reset(seed=[np.int64(3), None, np.uint8(1)])
    delayed.step(env.action_space.sample())
    env.close()


def test_seeds_of_numpy_give_the_starts_of_pythons():
    env = DeformTransportEnv(sigma_rad=np.float32(0.5))
    expected, _ = env.reset(seed=3)
    for seed in (np.int64(3), np.uint8(3), np.array(3), np.random.default_rng(0).integers(3, 4)):
        observation, _ = env.reset(seed=seed)
        np.testing.assert_array_equal(observation, expected)
        assert env.np_random_seed == 3
