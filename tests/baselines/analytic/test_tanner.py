"""The paper's controller transports the beam, within its certificate."""

import math

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic.tanner import TannerController, TannerParams, make_controller
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError, GainError, ParameterError
from defmanip_gym.params import DESIGN_DAMPING, PAPER_DISTURBANCE, BeamParams
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, CertificateConditions, certify
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

ENV_ID = "defmanip_gym:DeformTransport-v0"
SIGMA = math.pi / 6
L1 = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)


def transport(controller, *, certificate=None, count=1, seconds=60.0, start="paper", **arguments):
    """Return seconds to success (NaN for none) and largest swing of each episode."""
    env = gymnasium.make_vec(
        ENV_ID, num_envs=count, autoreset_mode="Disabled", constraint_mode="cost",
        max_episode_steps=10**6, **arguments,
    )  # fmt: skip
    if certificate is not None:
        env = NuMaxVectorActionScaling(env, certificate)
    observation, _ = env.reset(seed=11, options={"start": start})
    time, largest, state = np.full(count, np.nan), np.zeros(count), None
    for step in range(round(seconds / 0.02)):
        action, state = controller.predict(observation, state, np.full(count, step == 0))
        observation, _, terminated, _, info = env.step(action)
        running = np.isnan(time)
        swing = env.unwrapped.config.sigma_rad - info["constraint_margin"]
        largest = np.where(running, np.maximum(largest, swing), largest)
        time = np.where(running & terminated & info["is_success"], (step + 1) * 0.02, time)
        if not np.isnan(time).any():
            break
    return time, largest


def test_paper_start_under_l1_reaches_the_goal_within_a_minute_and_sigma():
    time, largest = transport(
        TannerController(certificate=L1), certificate=L1, disturbance=PAPER_DISTURBANCE
    )
    assert time[0] < 60.0
    assert largest[0] <= SIGMA


def test_it_also_does_when_the_feedback_linearization_believes_the_design_damping():
    time, largest = transport(
        TannerController(certificate=L1),
        certificate=L1,
        disturbance=PAPER_DISTURBANCE,
        nominal_beam=BeamParams(damping=DESIGN_DAMPING),
    )
    assert time[0] < 60.0
    assert largest[0] <= SIGMA


def test_sampled_starts_under_l1_all_reach_the_goal():
    time, largest = transport(
        TannerController(certificate=L1), certificate=L1, count=12, start="sampled"
    )
    assert not np.isnan(time).any()
    assert largest.max() <= SIGMA


def test_without_certificate_it_is_faster():
    bounded, _ = transport(TannerController(certificate=L1), certificate=L1)
    free, largest = transport(TannerController())
    assert free[0] < 0.75 * bounded[0]
    assert largest[0] <= SIGMA


def test_flexible_beams_are_carried_by_the_same_code():
    beam = BeamParams(segment_count=3)
    certificate = certify(beam, conditions=TRANSPORT_CONDITIONS)
    time, largest = transport(
        TannerController(beam=beam, certificate=certificate), certificate=certificate, beam=beam
    )
    assert time[0] < 60.0
    assert largest[0] <= SIGMA


def test_the_literal_field_crawls():
    literal = TannerController(params=TannerParams(velocity_field="literal"))
    env = gymnasium.make_vec(ENV_ID, num_envs=1, constraint_mode="cost")
    observation, _ = env.reset(options={"start": "paper"})
    state = None
    for step in range(500):
        action, state = literal.predict(observation, state, np.array([step == 0]))
        observation, *_ = env.step(action)
    assert np.hypot(observation[0, 5], observation[0, 6]) < 0.02
    assert abs(observation[0, 2]) < 0.05  # while the height has settled


def test_single_and_batched_predictions_agree():
    env = gymnasium.make_vec(ENV_ID, num_envs=5)
    observations, _ = env.reset(seed=0)
    controller = TannerController(certificate=L1)
    batched, _ = controller.predict(observations)
    for observation, action in zip(observations, batched, strict=True):
        single, _ = controller.predict(observation)
        assert single.shape == (3,)
        assert np.array_equal(single, action)


def test_memory_starts_anew_with_an_episode():
    env = gymnasium.make_vec(ENV_ID, num_envs=2)
    observations, _ = env.reset(seed=0)
    controller = TannerController()
    fresh, _ = controller.predict(observations)
    worn = (np.full((2, 3), 0.3), np.full((2, 3), 0.2))
    action, _ = controller.predict(observations, worn, np.array([True, False]))
    assert np.array_equal(action[0], fresh[0])
    assert not np.array_equal(action[1], fresh[1])


def test_gains_that_the_sampled_loop_cannot_have_are_refused():
    with pytest.raises(GainError, match="spectral radius"):
        TannerController(params=TannerParams(gains=ForceLoopGains(k1=0.5, k2=200.0)))
    with pytest.raises(GainError, match="force law"):
        TannerController(params=TannerParams(force_law_damping=1.0))


def test_certificates_without_room_to_lift_or_turn_are_refused():
    narrow = certify(BeamParams(), conditions=CertificateConditions(initial_swing_rad=0.01))
    with pytest.raises(CertificateError, match="TRANSPORT_CONDITIONS"):
        TannerController(certificate=narrow)
    with pytest.raises(CertificateError, match="coordinate_count"):
        TannerController(beam=BeamParams(segment_count=2), certificate=L1)


@pytest.mark.parametrize("name", ["beam", "robot", "task", "certificate", "params"])
@pytest.mark.parametrize("wrong", [5, 0, np.zeros(3), "nominal"])
def test_parameters_of_another_kind_are_refused(name, wrong):
    with pytest.raises(ParameterError, match=name):
        TannerController(**{name: wrong})


@pytest.mark.parametrize("segments", [2, 8, 16])
def test_its_factory_finds_gains_for_beams_of_several_segments(segments):
    config = TransportConfig(payload=RodPayload(beam=BeamParams(segment_count=segments)))
    assert make_controller(config).sampled_loop().spectral_radius() < 1.0


def test_its_factory_takes_the_tuned_gains_for_a_rod():
    assert make_controller(TransportConfig()).params == TannerParams()


@pytest.mark.parametrize("name", ["bound_share", "deceleration_share", "speed_share"])
def test_no_share_is_more_than_a_certificate_has(name):
    with pytest.raises(ParameterError, match=name):
        TannerParams(**{name: 1.2})
