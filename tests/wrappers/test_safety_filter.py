"""One wrapper for all filters: what it tells, when it applies, what it remembers."""

import copy

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import defmanip_gym
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams, RobotParams
from defmanip_gym.task_params import StartParams, TaskParams
from defmanip_gym.theory.filters.conditions import FilterConditions
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.filter_motions import moving_states
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper, SafetyFilterWrapper

TOLD = {
    "wished_action",
    "applied_action",
    "intervened",
    "correction_m_s2",
    "filter_margin",
    "filter_applies",
    "filter_reason",
}


def wrapped(made=None, **arguments):
    env = gymnasium.make(ENV_ID, constraint_mode="cost", **arguments)
    return SafetyFilterWrapper(env, made or StorageFilter())


def batch(count=8, made=None, delay=0, **arguments):
    arguments = {"constraint_mode": "cost", "autoreset_mode": AutoresetMode.SAME_STEP} | arguments
    env = gymnasium.make_vec(ENV_ID, num_envs=count, **arguments)
    env = ActionDelay(env, delay) if delay else env
    return SafetyFilterVectorWrapper(env, made or StorageFilter())


def pump(observation):
    """Return the action that feeds the swing, (n, 3)."""
    rate = np.atleast_2d(observation)[:, 15]
    return np.stack((-np.where(rate < 0, -1.0, 1.0), 0 * rate, 0 * rate), axis=1)


def test_info_tells_what_was_wished_and_what_was_done():
    env = wrapped()
    observation, info = env.reset(seed=0)
    assert TOLD <= set(info) and info["filter_applies"] is True
    for _ in range(150):
        action = pump(observation)[0]
        observation, _, _, _, info = env.step(action)
    assert TOLD <= set(info)
    np.testing.assert_array_equal(info["wished_action"], action)
    change = 3.0 * np.linalg.norm(info["applied_action"] - action)
    assert info["intervened"] and info["correction_m_s2"] == pytest.approx(change)
    assert 0 < env.filtering.intervention_rate < 1


def test_a_pumped_swing_stays_within_sigma_and_comes_near_it():
    env = batch(num_envs := 8, max_episode_steps=400)
    observation, _ = env.reset(seed=0)
    largest = np.zeros(num_envs)
    for _ in range(390):
        observation, _, _, _, info = env.step(pump(observation))
        assert info["filter_applies"].all()
        largest = np.maximum(largest, 1 - info["constraint_margin"] / (np.pi / 6))
    assert 0.93 < largest.min() and largest.max() < 1.0


def test_single_and_batch_do_the_same():
    single, several = wrapped(), batch(2)
    observation, _ = single.reset(seed=3)
    rows, _ = several.reset(seed=[3, 4])
    for _ in range(100):
        observation, _, _, _, info = single.step(pump(observation)[0])
        rows, _, _, _, infos = several.step(pump(rows))
        np.testing.assert_array_equal(observation, rows[0])
        assert info["correction_m_s2"] == infos["correction_m_s2"][0]


def test_a_copy_in_the_middle_of_an_episode_goes_on_alike():
    env = wrapped(StorageFilter(conditions=FilterConditions(swing_noise_rad=0.001)))
    observation, _ = env.reset(seed=0)
    for _ in range(60):
        observation, *_ = env.step(pump(observation)[0])
    state = defmanip_gym.get_state(env)
    there = copy.deepcopy(env)
    for _ in range(30):
        action = pump(observation)[0]
        observation, *_, info = env.step(action)
        copied, *_, told = there.step(action)
        np.testing.assert_array_equal(observation, copied)
        assert info["correction_m_s2"] == told["correction_m_s2"]
    defmanip_gym.set_state(env, state)
    assert env.filtering.steps == 60


def test_its_specification_makes_it_again():
    spec = wrapped().spec
    again = gymnasium.make(type(spec).from_json(spec.to_json()))
    assert isinstance(again, SafetyFilterWrapper)
    assert again.reset(seed=0)[1]["filter_applies"] is True


def test_it_passes_gymnasiums_check():
    check_env(wrapped(), skip_render_check=True)


@pytest.mark.parametrize(
    ("arguments", "made", "told"),
    [
        ({"beam": BeamParams(length_m=0.5)}, {}, "not computed for what"),
        ({"disturbance": DisturbanceParams(swing_sensor_noise_rad=0.02)}, {}, "with noise of 0.02"),
        ({"robot": RobotParams(drive_force_limit_n=60.0)}, {}, "forward errors"),
        ({"beam": BeamParams(), "nominal_beam": BeamParams(mass_kg=4.5)}, {}, "errors"),
        ({"disturbance": DisturbanceParams(force_bias_n=10.0)}, {}, "errors"),
        ({}, {"conditions": FilterConditions(forward_error_m_s2=0.01)}, "forward errors"),
        ({"task": TaskParams(max_speed_m_s=1.0)}, {}, "max_speed_m_s is 1"),
    ],
)
def test_what_is_not_provided_for_is_told(arguments, made, told):
    _, info = wrapped(StorageFilter(**made), **arguments).reset(seed=0)
    assert info["filter_applies"] is False and told in info["filter_reason"]


def test_a_delay_must_be_the_one_that_is_provided_for():
    late = StorageFilter(conditions=FilterConditions(delay_periods=2))
    for delay, expected in ((0, False), (1, False), (2, True)):
        _, info = batch(2, late, delay).reset(seed=0)
        assert info["filter_applies"].tolist() == [expected] * 2
        assert expected or "control periods late" in info["filter_reason"][0]


def test_wrappers_inside_that_may_change_actions_are_named():
    class Inverted(gymnasium.ActionWrapper):
        def action(self, action):
            return -action

    env = SafetyFilterWrapper(Inverted(gymnasium.make(ENV_ID)), StorageFilter())
    assert "Inverted may change" in env.reset(seed=0)[1]["filter_reason"]


class Kicked(gymnasium.Wrapper):
    """Does something else than it was asked once, and says that it does not."""

    keeps_actions = True

    def step(self, action):
        return self.env.step(-action)


def test_a_motion_that_is_not_as_foreseen_takes_the_promise_back():
    env = SafetyFilterWrapper(Kicked(gymnasium.make(ENV_ID)), StorageFilter())
    env.reset(seed=0)
    *_, info = env.step(np.array([1.0, 0.0, 0.0]))
    assert info["filter_applies"] is False and "beside what was foreseen" in info["filter_reason"]
    assert env.reset(seed=0)[1]["filter_applies"] is True


def test_from_outside_it_brings_the_storage_down_and_applies_once_inside():
    made = StorageFilter(sigma_rad=0.3, conditions=FilterConditions(storage_error=0.01))
    env = wrapped(made, beam=BeamParams(damping=0.0))
    start = (-8.0, 5.0, 0.0, np.pi / 3, -np.pi / 2, 0.45)
    observation, info = env.reset(options={"start": start})
    assert info["filter_applies"] is False and "once it does not" in info["filter_reason"]
    shares = []
    for _ in range(150):
        shares.append(
            float(
                made.shares_of(
                    observation[None, 14:15], observation[None, 15:16], observation[None, 9]
                )[0]
            )
        )
        observation, _, _, _, info = env.step(pump(observation)[0])
    steps = np.diff([share for share in shares if share > 1])
    assert steps.max() < 0.01 and shares[0] > 2 and shares[-1] < 1.01
    assert info["filter_applies"] is True


def test_a_filter_for_an_environment_applies_there():
    for arguments, delay in (
        ({}, 1),
        ({"disturbance": DisturbanceParams(force_bias_n=2.0, swing_sensor_noise_rad=0.01)}, 0),
        ({"beam_ranges": BeamRanges(damping=(0.0, 1.0), length_m=(0.55, 0.65))}, 0),
    ):
        env = gymnasium.make_vec(ENV_ID, num_envs=2, **arguments)
        made = filter_for(env.unwrapped.config, delay_periods=delay)
        _, info = SafetyFilterVectorWrapper(ActionDelay(env, delay), made).reset(seed=0)
        assert info["filter_applies"].all(), info["filter_reason"]


def test_filters_that_do_not_fit_are_refused():
    for arguments, told in (
        ({"control_mode": "force"}, "task mode"),
        ({"beam": BeamParams(segment_count=2)}, "segment_count"),
        ({"sigma_rad": 0.3}, "sigma_rad"),
        ({"task": TaskParams(control_period_s=0.04)}, "control_period_s"),
    ):
        with pytest.raises(CertificateError, match=told):
            SafetyFilterWrapper(gymnasium.make(ENV_ID, **arguments), StorageFilter())
    with pytest.raises(CertificateError, match="DeformTransport"):
        SafetyFilterWrapper(gymnasium.make("CartPole-v1"), StorageFilter())
    with pytest.raises(ParameterError, match="SafetyFilter"):
        SafetyFilterWrapper(gymnasium.make(ENV_ID), "storage")


def test_stepping_before_a_reset_is_refused():
    with pytest.raises(ResetNeeded):
        wrapped().step(np.zeros(3))
    with pytest.raises(ResetNeeded):
        batch(2).step(np.zeros((2, 3)))


def test_filters_are_not_made_of_something_else():
    config = gymnasium.make(ENV_ID).unwrapped.config
    for arguments in ({"beam": "b"}, {"kind": int}, {"delay_periods": -1}):
        with pytest.raises(ParameterError):
            filter_for(config, **arguments)
    with pytest.raises(CertificateError, match="task mode"):
        filter_for(gymnasium.make(ENV_ID, control_mode="force").unwrapped.config)
    with pytest.raises(CertificateError, match="segment_count"):
        filter_for(config, beam=BeamParams(segment_count=2))


def test_every_motion_of_the_search_is_one_that_the_arm_can_have():
    """Low goals leave reaches without heights, which are not searched."""
    start = StartParams(
        center=(-8.5, 5.5, 0.0, 1.9, -2.3, 0.0), spread=(1.5, 1.5, 0.5, 0.1, 0.1, 0.05)
    )
    task = TaskParams(start=start, goal=(0.0, 0.0, 0.0, 0.6, -1.2, 0.0))
    config = gymnasium.make(ENV_ID, task=task).unwrapped.config
    made = StorageFilter(task=task)
    motions = moving_states(config, made, 400, np.random.default_rng(0))
    assert all(np.isfinite(part).all() for part in vars(motions).values())
