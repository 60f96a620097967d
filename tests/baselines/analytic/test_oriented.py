"""The paper's cascade on the oriented field arrives from everywhere, with any heading."""

import math

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic.oriented import ORIENTED_PARAMS, make_controller
from defmanip_gym.baselines.analytic.tanner import TannerController
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify

ARM = (math.pi / 3, -math.pi / 2, 0.03)


def transport(controller, starts, *, seconds, **arguments):
    """Return seconds to success (NaN for none) and largest swing over σ of each episode."""
    count = len(starts)
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0", num_envs=count, autoreset_mode="Disabled",
        constraint_mode="cost", max_episode_steps=10**6, num_threads=1, **arguments,
    )  # fmt: skip
    observation, _ = env.reset(seed=1, options={"start": np.array(starts)})
    time, largest, state = np.full(count, np.nan), np.zeros(count), None
    for step in range(round(seconds / 0.02)):
        action, state = controller.predict(observation, state, np.full(count, step == 0))
        running = np.isnan(time)
        observation, _, _, _, info = env.step(np.where(running[:, None], action, 0.0))
        swing = 1.0 - info["constraint_margin"] / env.unwrapped.config.sigma_rad
        largest = np.where(running, np.maximum(largest, swing), largest)
        time = np.where(running & info["is_success"], (step + 1) * 0.02, time)
        if not np.isnan(time).any():
            break
    return time, largest


def test_arrives_from_all_sides_with_all_headings_within_sigma():
    bearings, headings = np.meshgrid(np.arange(-3, 3), np.arange(-3, 3))
    starts = [
        (9 * math.cos(1.05 * bearing), 9 * math.sin(1.05 * bearing), 1.05 * heading, *ARM)
        for bearing, heading in zip(bearings.ravel(), headings.ravel(), strict=True)
    ]
    time, largest = transport(make_controller(TransportConfig()), starts, seconds=14.0)
    assert not np.isnan(time).any()
    assert np.median(time) < 8.0  # 4.5 s of straight flight
    assert largest.max() < 1.0


def test_the_reference_beam_gets_the_parameters_as_they_are():
    found = make_controller(TransportConfig()).params
    assert found.gains == ORIENTED_PARAMS.gains
    assert found.tracking_gain == ORIENTED_PARAMS.tracking_gain
    assert found.force_law_damping == pytest.approx(ORIENTED_PARAMS.force_law_damping)


def test_backs_up_to_a_goal_that_it_has_left_behind():
    time, _ = transport(make_controller(TransportConfig()), [(6, 0.3, 0.1, *ARM)], seconds=8.0)
    assert time[0] < 5.5  # 3 s of straight flight; over a turn it would be 8 s


def test_keeps_to_a_certificates_bounds():
    bound = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)
    controller = TannerController(certificate=bound, params=ORIENTED_PARAMS)
    time, largest = transport(controller, [(-5, 3, 0, *ARM), (4, -3, 2, *ARM)], seconds=40.0)
    assert not np.isnan(time).any()
    assert largest.max() < 0.3
    assert controller.field.yaw_rate_rad_s <= bound.conditions.yaw_rate_rad_s
