"""What an environment's Gymnasium specification says in JSON makes the same environment again."""

import json
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from defmanip_gym.baselines.residual_action import ResidualAction
from defmanip_gym.envs.registration import ENV_ID, ENV_IDS
from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import (
    BeamParams,
    BeamRanges,
    DisturbanceParams,
    LinkParams,
    RobotParams,
)
from defmanip_gym.task_params import RewardParams, StartParams, TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, ParameterIntervals, certify
from defmanip_gym.theory.payload.zero_dynamics import linearize
from defmanip_gym.validation import plain
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling

ROBOT = RobotParams(base_mass_kg=60.0, upper_arm=LinkParams(length_m=0.62, mass_kg=4.0))
ARGUMENTS = [
    {},
    {"beam": BeamParams(damping=0.3, segment_count=2), "sigma_rad": 0.4},
    {"nominal_beam": BeamParams(mass_kg=3.0), "nominal_robot": ROBOT, "robot": ROBOT},
    {
        "task": TaskParams(
            goal=np.array((0.5, 0.0, 0.0, 1.5, -1.5, 0.0)),
            start=StartParams(spread=(0.1,) * 5 + (0.0,)),
            reward=RewardParams(success_bonus=3.0),
        ),
        "constraint_mode": "cost",
    },
    {"disturbance": DisturbanceParams(force_bias_n=0.5, swing_sensor_noise_rad=0.01)},
    {"inner_loop": "measured_force", "beam": BeamParams(mass_kg=5.0)},
    {"beam_ranges": BeamRanges(length_m=np.array([0.5, 0.7]))},
]


def again(env):
    return EnvSpec.from_json(env.spec.to_json())


def course(env, action=0.3):
    observation, info = env.reset(seed=3)
    course = [observation]
    for _ in range(20):
        observation, reward, *_, info = env.step(np.full(env.action_space.shape, action))
        course += [observation, np.ravel(reward), np.ravel(info["beam_mass_kg"])]
    env.close()
    return np.concatenate([np.ravel(part) for part in course])


def assert_same(env, other):
    np.testing.assert_array_equal(course(other), course(env), strict=True)
    assert other.unwrapped.config == env.unwrapped.config


@pytest.mark.parametrize("env_id", ENV_IDS)
@pytest.mark.parametrize("arguments", ARGUMENTS, ids=lambda arguments: "-".join(arguments))
def test_environment_comes_back_from_json(env_id, arguments):
    env = gymnasium.make(env_id, **arguments)
    assert_same(env, gymnasium.make(again(env)))


def test_batch_comes_back_from_json():
    arguments = {"beam": BeamParams(damping=0.2), "autoreset_mode": "Disabled"}
    env = gymnasium.make_vec(ENV_IDS[1], num_envs=2, num_threads=1, **arguments)
    other = gymnasium.make_vec(again(env))
    assert_same(env, other)
    assert (other.num_envs, other.autoreset_mode) == (2, env.autoreset_mode)


@pytest.mark.parametrize("deformable", [BeamParams(), linearize(BeamParams())])
def test_environment_within_a_certificate_comes_back_from_json(deformable):
    certificate = certify(
        deformable,
        conditions=TRANSPORT_CONDITIONS,
        intervals=ParameterIntervals(damping=(0.9, 1.1)),
    )
    env = NuMaxActionScaling(gymnasium.make(ENV_ID), certificate)
    other = gymnasium.make(again(env))
    assert isinstance(other, NuMaxActionScaling)
    assert_same(env, other)
    assert other.spec.to_json() == env.spec.to_json()


def test_residual_environment_comes_back_from_json_with_one_certificate():
    env = ResidualAction(gymnasium.make(ENV_ID), decision_periods=np.int64(2))
    other = gymnasium.make(again(env))
    assert_same(env, other)
    assert other.spec.to_json() == env.spec.to_json()
    names = [wrapper.name for wrapper in env.spec.additional_wrappers]
    assert names == ["ResidualAction"]


@pytest.mark.parametrize("method", ["tanner", "l1"])
def test_certificate_is_what_its_json_says(method):
    certificate = certify(BeamParams(), method=method)
    content = json.loads(json.dumps(plain(certificate)))
    assert type(certificate)(**content) == certificate


@pytest.mark.parametrize(
    ("argument", "mapping", "name"),
    [
        ("beam", {"mass": 1.0}, "beam"),
        ("beam", {"mass_kg": -1.0}, "mass_kg"),
        ("robot", {"upper_arm": {"length": 1.0}}, "upper_arm"),
        ("task", {"reward": {"bonus": 1.0}}, "reward"),
        ("task", {1: 2}, "task"),
        ("beam", [("mass_kg", 1.0)], "beam"),
    ],
)
def test_mapping_of_other_things_than_the_fields_is_refused(argument, mapping, name):
    with pytest.raises(ParameterError) as caught:
        gymnasium.make(ENV_ID, **{argument: mapping})
    assert caught.value.name == name


def test_certificate_that_is_none_is_refused():
    env = gymnasium.make(ENV_ID)
    content = plain(certify(BeamParams()))
    for bad in (5, None, {}, content | {"deformable": {"equilibrium": [0.0]}}, content | {"nu": 1}):
        with pytest.raises(ParameterError):
            NuMaxActionScaling(env, bad)
    with pytest.raises(CertificateError, match="sigma_rad"):
        NuMaxActionScaling(env, content | {"sigma_rad": 0.6})


def test_linearized_object_takes_lists_and_refuses_other_shapes():
    linear = linearize(BeamParams(segment_count=2))
    same = type(linear)(**plain(linear))
    np.testing.assert_array_equal(same.A_u, linear.A_u)
    for name, bad in (("m_o22", [[1.0]]), ("k_o22", "stiff"), ("equilibrium", [np.nan, 0.0])):
        with pytest.raises(ParameterError, match=name):
            replace(linear, **{name: bad})
    with pytest.raises(ParameterError, match="m_o22"):
        replace(linear, m_o22=np.zeros((2, 2)))


@pytest.mark.parametrize(
    "arguments",
    [
        {"width": np.int64(84)},
        {"sigma_rad": np.float32(0.5)},
        {"task": {"goal": np.array((0.0, 0.0, 0.0, 1.5, -1.5, 0.0))}},
        {"default_camera_config": {"lookat": np.array((0.0, 0.0, 1.0))}},
    ],
)
def test_numpys_numbers_go_through_json(arguments):
    env = gymnasium.make(ENV_ID, **arguments)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config


def test_a_batchs_specification_goes_through_json():
    mode = gymnasium.vector.AutoresetMode.SAME_STEP
    env = gymnasium.make_vec(ENV_ID, num_envs=np.int64(2), autoreset_mode=mode)
    assert EnvSpec.from_json(env.spec.to_json()).kwargs["autoreset_mode"] == "SameStep"


def test_images_show_an_episode_at_its_own_speed():
    task = TaskParams(control_period_s=0.1)
    assert gymnasium.make(ENV_ID, task=task).metadata["render_fps"] == 10
    assert gymnasium.make_vec(ENV_ID, num_envs=2, task=task).metadata["render_fps"] == 10
