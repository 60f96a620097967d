"""No policy inside the wrapper violates the certificate, and the wrapper says what it did."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.baselines.controller import RandomController
from defmanip_gym.errors import ActionError, CertificateError
from defmanip_gym.params import PAPER_DISTURBANCE, BeamParams
from defmanip_gym.theory.certificates import (
    TRANSPORT_CONDITIONS,
    CertificateConditions,
    certify,
)
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling, NuMaxVectorActionScaling

ENV_ID = "defmanip_gym:DeformTransport-v0"
L1 = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)


def batch(count=8, certificate=L1, **arguments):
    env = gymnasium.make_vec(
        ENV_ID, num_envs=count, autoreset_mode="Disabled", constraint_mode="cost", **arguments
    )
    return NuMaxVectorActionScaling(env, certificate)


def worst_swing_share(env, policy, steps=1000, seed=7):
    observation, _ = env.reset(seed=seed)
    worst, running = 0.0, np.ones(env.num_envs, dtype=bool)
    for _ in range(steps):
        observation, _, terminated, _, info = env.step(policy(observation))
        running &= ~terminated
        swing = 1 - info["constraint_margin"][running] / env.unwrapped.config.sigma_rad
        worst = max(worst, swing.max(initial=0.0))
    return worst


def resonant(observation):
    """Push against the swing, pump the vertical at twice its frequency, turn as fast as allowed."""
    swing, rate = observation[:, 14], observation[:, 15]
    return np.stack((-np.sign(rate + 1e-9), np.ones_like(rate), np.sign(swing * rate)), axis=1)


def forward_resonant(observation):
    action = resonant(observation)
    action[:, 1:] = 0.0
    return action


@pytest.mark.parametrize("policy", [resonant, forward_resonant])
def test_resonant_attacks_do_not_violate(policy):
    assert worst_swing_share(batch(disturbance=PAPER_DISTURBANCE), policy) < 1.0


def test_the_same_attack_without_the_wrapper_violates():
    assert worst_swing_share(batch().env, forward_resonant, steps=60) > 1.0


@pytest.mark.parametrize("segments", [1, 3])
def test_random_actions_do_not_violate(segments):
    beam = BeamParams(segment_count=segments)
    certificate = certify(beam, conditions=TRANSPORT_CONDITIONS)
    controller = RandomController(seed=1)
    env = batch(certificate=certificate, beam=beam)
    assert worst_swing_share(env, lambda o: controller.predict(o)[0]) < 1.0


def test_motion_stays_within_the_conditions():
    env = batch(disturbance=PAPER_DISTURBANCE)
    observation, _ = env.reset(seed=0)
    config = env.unwrapped.config
    period, rates, accelerations = config.task.control_period_s, [], []
    for _ in range(300):
        before = observation
        observation, _, terminated, _, _ = env.step(resonant(observation))
        if terminated.any():
            break
        rates.append(np.abs(observation[:, 9]).max())
        accelerations.append(np.abs(observation[:, 7] - before[:, 7]).max() / period)
    conditions = L1.conditions
    assert max(rates) <= conditions.yaw_rate_rad_s + 2e-3
    assert max(accelerations) <= conditions.vertical_acceleration_m_s2


def test_a_controller_within_the_bounds_is_left_alone():
    env = batch()
    controller = TannerController(certificate=L1, params=replace(GENTLE_PARAMS, bound_share=0.7))
    observation, _ = env.reset(seed=0)
    state = None
    for k in range(200):
        action, state = controller.predict(observation, state, np.full(8, k == 0))
        observation, *_, info = env.step(action)
        assert not info["intervened"].any()
    assert env.filtering.interventions == 0


def test_braking_is_never_reduced_below_the_bound():
    env = batch(1)
    env.reset(options={"start": "paper"})
    for _ in range(400):
        observation, *_ = env.step(np.array([[1.0, 0.0, 0.0]]))
    fast = observation[0, 5]
    assert fast > 1.0
    for _ in range(50):
        observation, *_ = env.step(np.array([[-1.0, 0.0, 0.0]]))
    assert observation[0, 5] == pytest.approx(fast - L1.acceleration_bound, abs=5e-3)


def test_interventions_are_counted_in_size_and_number():
    env = NuMaxActionScaling(gymnasium.make(ENV_ID), L1)
    env.reset(seed=0)
    *_, info = env.step(np.array([1.0, 0.0, 0.0]))
    assert info["intervened"] is True
    assert info["intervention_m_s2"] == pytest.approx(3.0 - L1.acceleration_bound)
    *_, info = env.step(np.zeros(3))
    assert info["intervened"] is False
    assert env.filtering.intervention_rate == pytest.approx(0.5)


def test_single_and_batched_wrapper_agree_bit_for_bit():
    single = NuMaxActionScaling(gymnasium.make(ENV_ID, constraint_mode="cost"), L1)
    many = batch(3)
    one, _ = single.reset(seed=21)
    three, _ = many.reset(seed=20)
    actions = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    for action in actions:
        one, *_ = single.step(action)
        three, *_ = many.step(np.tile(action, (3, 1)))
    assert np.array_equal(one, three[1])


def test_a_certificate_for_more_damping_than_there_is_is_flagged():
    for damping, covered in ((0.1, True), (0.05, True), (1.0, False)):
        certificate = certify(BeamParams(damping=damping), conditions=TRANSPORT_CONDITIONS)
        _, info = NuMaxActionScaling(gymnasium.make(ENV_ID), certificate).reset(seed=0)
        assert info["certificate_applies"] is covered


def test_disturbances_larger_than_the_bound_are_countered():
    certificate = certify(BeamParams(), method="tanner", conditions=TRANSPORT_CONDITIONS)
    env = batch(certificate=certificate, disturbance=PAPER_DISTURBANCE)
    observation, _ = env.reset(seed=0)
    for _ in range(250):
        observation, *_ = env.step(np.zeros((8, 3)))
    speed = np.linalg.norm(observation[:, 5:8], axis=1).max()
    assert speed < 5 * 0.02 * 0.05  # without: some 0.01 m/s² for 5 s


def test_starts_outside_the_conditions_are_flagged():
    env = NuMaxActionScaling(gymnasium.make(ENV_ID), L1)
    _, info = env.reset(options={"start": (-8, 5, 0, 1.0, -1.5, 0.04)})
    assert info["certificate_applies"] is True
    _, info = env.reset(options={"start": (-8, 5, 0, 1.0, -1.5, 0.2)})
    assert info["certificate_applies"] is False


@pytest.mark.filterwarnings("ignore:.*observation space.*infinity")
def test_wrapped_environment_passes_gymnasiums_check():
    env = gymnasium.make(ENV_ID).unwrapped
    check_env(NuMaxActionScaling(env, L1), skip_render_check=True)


def test_certificates_that_do_not_fit_are_refused():
    with pytest.raises(CertificateError, match="task"):
        NuMaxActionScaling(gymnasium.make(ENV_ID, control_mode="force"), L1)
    with pytest.raises(CertificateError, match="segment_count"):
        NuMaxActionScaling(gymnasium.make(ENV_ID, beam=BeamParams(segment_count=2)), L1)
    with pytest.raises(CertificateError, match="sigma"):
        NuMaxActionScaling(gymnasium.make(ENV_ID, sigma_rad=0.3), L1)
    with pytest.raises(CertificateError, match="DeformTransport"):
        NuMaxActionScaling(gymnasium.make("CartPole-v1"), L1)


def test_transformed_observations_inside_are_refused():
    env = gymnasium.make(ENV_ID)
    blind = gymnasium.wrappers.TransformObservation(env, lambda o: o * 0, env.observation_space)
    with pytest.raises(CertificateError, match="around"):
        NuMaxActionScaling(blind, L1)
    with pytest.raises(ResetNeeded):
        NuMaxVectorActionScaling(batch().env, L1).step(np.zeros((8, 3)))


def test_bad_actions_are_refused_by_name():
    env = NuMaxActionScaling(gymnasium.make(ENV_ID), L1)
    env.reset(seed=0)
    for action in ("abc", np.zeros(2), np.full(3, np.nan)):
        with pytest.raises(ActionError):
            env.step(action)


def test_conditions_that_leave_no_room_are_refused():
    with pytest.raises(CertificateError, match="ask for less"):
        certify(BeamParams(), conditions=CertificateConditions(vertical_acceleration_m_s2=5.0))


def test_the_ignored_step_of_next_step_mode_is_not_counted():
    env = NuMaxVectorActionScaling(
        gymnasium.make_vec(ENV_ID, num_envs=2, autoreset_mode="NextStep", max_episode_steps=2), L1
    )
    env.reset(seed=0)
    for action in (0.2, 0.2, np.nan, 0.2):  # the third is ignored
        env.step(np.full((2, 3), action))
    assert env.filtering.steps == 6
    env.step(np.full((2, 3), 0.2))  # ends the second episodes
    env.reset(seed=1)
    with pytest.raises(ActionError):
        env.step(np.full((2, 3), np.nan))


def test_what_callers_do_to_observations_does_not_reach_the_wrapper():
    spoiled, left = batch(3), batch(3)
    for env in (spoiled, left):
        env.reset(seed=4)
    for k in range(10):
        actions = np.full((3, 3), 0.5)
        theirs, ours = spoiled.step(actions)[0], left.step(actions)[0]
        assert np.array_equal(theirs, ours)
        theirs[:] = 50.0
        if k == 5:
            mask = {"reset_mask": np.array([True, False, False])}
            assert np.array_equal(spoiled.reset(options=mask)[0], left.reset(options=mask)[0])
