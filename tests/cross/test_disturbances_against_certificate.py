"""What disturbances do on the plant within a period, against the room that certificates make."""

import numpy as np
import pytest

from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import PAPER_DISTURBANCE, DisturbanceParams, TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

LAYOUT = ObservationLayout(1)
PERIOD_S, LIMIT_M_S2 = TaskParams().control_period_s, TaskParams().max_acceleration_m_s2
DELAY = Condition(name="delay", actuation_delay_s=0.02)
STRONG = DisturbanceParams(force_amplitude_n=2.0, force_frequency_rad_s=5.0)


class Sent:
    """Keeps what the wrapper sends on, to hold it against what the grasp does."""

    def __init__(self, env):
        self.env, self.actions, self._step = env, None, env.step
        env.step = self.step

    def step(self, actions):
        self.actions = actions.copy()
        return self._step(actions)


def surprises(condition, make_batch, steps=150):
    """Return forward and upward acceleration minus what the wrapper counted on, and the swing."""
    config = condition.environment
    env = make_batch(4, beam=config.beam, disturbance=config.disturbance)
    if condition.delay_periods:
        env = ActionDelay(env, condition.delay_periods)
    sent = Sent(env)
    certificate = certify(NOMINAL_BEAM, method="phase_plane", conditions=TRANSPORT_CONDITIONS)
    env = NuMaxVectorActionScaling(env, certificate)
    observation, _ = env.reset(seed=3)
    excess, found, swings = np.zeros((4, 2)), [], []
    for _ in range(steps):
        rate = LAYOUT.part(observation, "swing_rate")
        push = np.hstack((-np.sign(rate + 1e-9), np.zeros_like(rate), np.ones_like(rate)))
        swings.append(np.abs(LAYOUT.part(observation, "swing"))[:, 0])
        before = LAYOUT.part(observation, "grasp_velocity_b")[:, [0, 2]]
        observation, *_ = env.step(push)
        after = LAYOUT.part(observation, "grasp_velocity_b")[:, [0, 2]]
        now = (after - before) / PERIOD_S - LIMIT_M_S2 * sent.actions[:, [0, 2]]
        found.append(np.abs(now - excess))
        excess = now
    return np.array(found), np.array(swings)


def test_the_papers_disturbance_is_within_the_room(make_batch):
    found, swing = surprises(Condition(name="x", disturbance=PAPER_DISTURBANCE), make_batch)
    room, upward_room = 0.01, 0.01
    assert found[1:, :, 1].max() < upward_room
    # what exceeds it in the first period acts as a forward acceleration times tan(swing)
    beyond = np.maximum(found[..., 1] - upward_room, 0.0) * np.tan(swing)
    assert (found[..., 0] + beyond).max() < room
    assert found[0, :, 0].min() > 0.5 * room  # and needs it


@pytest.mark.parametrize("condition", [Condition(name="x", disturbance=STRONG), DELAY])
def test_what_is_not_provided_for_exceeds_the_room(condition, make_batch):
    assert not condition.within_certificate_conditions
    assert surprises(condition, make_batch)[0][..., 0].max() > 0.02
