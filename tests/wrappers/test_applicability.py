"""A certificate says that it applies only where everything it takes for granted holds."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from defmanip_gym.errors import CertificateError
from defmanip_gym.params import (
    PAPER_DISTURBANCE,
    BeamParams,
    BeamRanges,
    DisturbanceParams,
    LinkParams,
    RobotParams,
)
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.certificate_for import certificate_for
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling, NuMaxVectorActionScaling

ENV_ID = "defmanip_gym:DeformTransport-v0"
BEAM = BeamParams()
CERTIFICATE = certify(BEAM, method="phase_plane", conditions=TRANSPORT_CONDITIONS)
STUBBY = BeamParams(mass_kg=10.0, length_m=0.1, damping=0.2426)


def wrapped(certificate=CERTIFICATE, **arguments):
    return NuMaxActionScaling(gymnasium.make(ENV_ID, **arguments), certificate)


def reason(certificate=CERTIFICATE, **arguments):
    """Return why the certificate does not apply to a start; empty where it does."""
    _, info = wrapped(certificate, **arguments).reset(seed=0)
    assert info["certificate_applies"] is (info["certificate_reason"] == "")
    return info["certificate_reason"]


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"disturbance": PAPER_DISTURBANCE},
        {"beam": BeamParams(damping=0.3)},
        {"nominal_beam": BEAM},
        {"task": TaskParams(control_period_s=0.01)},
        {"task": TaskParams(max_speed_m_s=1.0)},
        {"disturbance": DisturbanceParams(force_sensor_noise_n=0.5)},
    ],
)
def test_it_applies_where_errors_have_room(arguments):
    assert reason(**arguments) == ""


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"beam": BeamParams(damping=0.05)}, "not computed for what"),
        ({"disturbance": DisturbanceParams(swing_sensor_noise_rad=0.02)}, "measured to within"),
        ({"disturbance": DisturbanceParams(force_amplitude_n=2, force_frequency_rad_s=5)}, ""),
        ({"disturbance": DisturbanceParams(force_bias_n=2.0)}, ""),
        ({"task": TaskParams(control_period_s=0.05)}, ""),
        ({"task": TaskParams(control_period_s=0.2)}, ""),
        ({"task": TaskParams(max_acceleration_m_s2=20.0)}, "turn"),
        ({"nominal_beam": replace(BEAM, damping=1.0)}, "errors"),
        ({"nominal_beam": replace(BEAM, mass_kg=3.2)}, "errors"),
        ({"nominal_beam": replace(BEAM, length_m=0.7)}, "errors"),
        ({"nominal_robot": RobotParams(forearm=LinkParams(length_m=0.7, mass_kg=4.0))}, ""),
        ({"robot": RobotParams(shoulder_torque_limit_nm=60.0)}, "errors"),
    ],
)
def test_what_the_configuration_tells_makes_it_not_apply(arguments, told):
    found = reason(**arguments)
    assert found and told in found


def test_errors_of_a_stubby_beam_exceed_the_room_that_is_enough_for_the_reference():
    certificate = certify(STUBBY, method="phase_plane", conditions=TRANSPORT_CONDITIONS)
    assert "errors" in reason(certificate, beam=STUBBY, nominal_beam=STUBBY)


def test_without_conditions_there_is_no_room_for_errors():
    certificate = certify(BeamParams(damping=1.0), method="phase_plane")
    start = {"start": (-8.5, 5.5, 0.0, np.pi / 3, -np.pi / 2, 0.0)}
    _, info = wrapped(certificate, beam=BeamParams(damping=1.0)).reset(options=start)
    assert "room for 0 m/s²" in info["certificate_reason"]


def test_a_proof_for_the_linear_object_alone_is_not_enough():
    beam = BeamParams(segment_count=3)
    certificate = certify(beam, conditions=TRANSPORT_CONDITIONS)
    assert "linearized" in reason(certificate, beam=beam)


class Inverted(gymnasium.ActionWrapper):
    def action(self, action):
        return -action


class Silent(gymnasium.Wrapper):
    def step(self, action):
        return self.env.step(-action)


class Honest(Silent):
    keeps_actions = True


def test_wrappers_inside_that_may_change_actions_are_named():
    for wrapper, told in ((Inverted, "Inverted"), (Silent, "Silent"), (Honest, "")):
        env = NuMaxActionScaling(wrapper(gymnasium.make(ENV_ID)), CERTIFICATE)
        _, info = env.reset(seed=0)
        assert told in info["certificate_reason"]
        assert info["certificate_applies"] is (told == "")
    for periods in (0, 1):
        delayed = ActionDelay(gymnasium.make_vec(ENV_ID, num_envs=2), periods)
        _, info = NuMaxVectorActionScaling(delayed, CERTIFICATE).reset(seed=0)
        assert info["certificate_applies"].tolist() == [periods == 0] * 2


def test_gymnasiums_harmless_wrappers_inside_change_nothing():
    env = gymnasium.make(ENV_ID)
    env = gymnasium.wrappers.NormalizeReward(gymnasium.wrappers.RecordEpisodeStatistics(env))
    _, info = NuMaxActionScaling(env, CERTIFICATE).reset(seed=0)
    assert info["certificate_applies"] is True


def test_a_motion_that_does_not_follow_is_noticed():
    env = NuMaxActionScaling(Honest(gymnasium.make(ENV_ID)), CERTIFICATE)  # it lies
    _, info = env.reset(seed=0)
    assert info["certificate_applies"] is True
    *_, info = env.step(np.array([1.0, 0.0, 0.0]))
    assert info["certificate_applies"] is False
    assert "errors took" in info["certificate_reason"]
    _, info = env.reset(seed=0)
    assert info["certificate_applies"] is True


def test_an_arm_outside_of_starts_and_goal_is_told():
    env = wrapped()
    _, info = env.reset(options={"start": (-8, 5, 0, 1.4, -0.4, 0.0)})
    assert "the arm started at" in info["certificate_reason"]


def test_room_follows_from_the_environment_where_it_is_asked_for():
    for beam in (STUBBY, BeamParams(mass_kg=1.0, length_m=0.3, damping=0.3)):
        config = gymnasium.make(ENV_ID, beam=beam, nominal_beam=beam).unwrapped.config
        certificate = certificate_for(config)
        room = certificate.conditions.acceleration_error_m_s2
        assert room > TRANSPORT_CONDITIONS.acceleration_error_m_s2
        assert reason(certificate, beam=beam, nominal_beam=beam) == ""


def test_errors_beyond_every_room_are_refused():
    task = TaskParams(control_period_s=0.2)
    config = gymnasium.make(ENV_ID, task=task).unwrapped.config
    with pytest.raises(CertificateError, match="use up"):
        certificate_for(config)


def test_ranges_of_damping_are_certified_at_their_ends():
    ranges = BeamRanges(damping=(0.1, 0.5))
    env = gymnasium.make(ENV_ID, beam_ranges=ranges)
    certificate = certificate_for(env.unwrapped.config)
    assert reason(certificate, beam_ranges=ranges) == ""


def test_an_environment_too_dear_to_search_for_errors_gets_no_promise():
    task = TaskParams(control_period_s=0.01, physics_period_s=1e-5)
    env = NuMaxActionScaling(gymnasium.make(ENV_ID, task=task), CERTIFICATE)
    _, info = env.reset(seed=0)
    assert not info["certificate_applies"]
    assert "errors are not known" in info["certificate_reason"]
    with pytest.raises(CertificateError, match="longer physics steps"):
        certificate_for(env.unwrapped.config)
