"""What disturbances do on the plant within a period, against the room that certificates make."""

import numpy as np

from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import PAPER_DISTURBANCE, DisturbanceParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.theory.dynamics.frames import base_to_world
from defmanip_gym.wrappers.applicability import Applicability
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling, nu_max_filter

LAYOUT = ObservationLayout(1)
PERIOD_S, LIMIT_M_S2 = TaskParams().control_period_s, TaskParams().max_acceleration_m_s2
FORWARD_ROOM = TRANSPORT_CONDITIONS.acceleration_error_m_s2
UPWARD_ROOM = TRANSPORT_CONDITIONS.vertical_error_m_s2
CERTIFICATE = certify(NOMINAL_BEAM, method="phase_plane", conditions=TRANSPORT_CONDITIONS)
STRONG = DisturbanceParams(force_amplitude_n=2.0, force_frequency_rad_s=5.0)


class Sent:
    """Keeps what the wrapper sends on, to hold it against what the grasp does."""

    def __init__(self, env):
        self.env, self.actions, self._step = env, None, env.step
        env.step = self.step

    def step(self, actions):
        self.actions = actions.copy()
        return self._step(actions)


def outward(observation, rng):
    """Push with the swing, and upward."""
    rate = LAYOUT.part(observation, "swing_rate")
    return np.hstack((-np.sign(rate + 1e-9), np.zeros_like(rate), np.ones_like(rate)))


def wild(observation, rng):
    """Push with the swing while turning and lifting erratically."""
    actions = np.sign(rng.uniform(-1, 1, (len(observation), 3)))
    actions[:, 0] = -np.sign(LAYOUT.part(observation, "swing_rate")[:, 0])
    return actions


def surprises(condition, make_batch, push=outward, *, count=4, steps=150):
    """Return forward and upward acceleration minus what the wrapper counted on, and the swing."""
    config, rng = condition.environment, np.random.default_rng(0)
    env = make_batch(count, beam=config.beam, disturbance=config.disturbance)
    sent = Sent(env)
    certificate = CERTIFICATE
    env = NuMaxVectorActionScaling(env, certificate)
    observation, _ = env.reset(seed=3)
    excess, found, swings = np.zeros((count, 2)), [], []
    for _ in range(steps):
        swings.append(np.abs(LAYOUT.part(observation, "swing"))[:, 0])
        before, heading = motion(observation)
        observation, *_ = env.step(push(observation, rng))
        velocity, heading_now = motion(observation)
        gained = velocity - base_to_world(before, heading - heading_now)
        now = (gained / PERIOD_S - LIMIT_M_S2 * sent.actions)[:, [0, 2]]
        found.append(np.abs(now - excess))
        excess = now
    return np.array(found), np.array(swings)


def motion(observation):
    """Return the grasp's velocity in the base frame and the heading."""
    sine, cosine = LAYOUT.part(observation, "heading").T
    return LAYOUT.part(observation, "grasp_velocity_b"), np.arctan2(sine, cosine)


def test_the_papers_disturbance_is_within_the_room(make_batch):
    found, _ = surprises(Condition(name="x", disturbance=PAPER_DISTURBANCE), make_batch)
    assert (found.max(axis=(0, 1)) < (FORWARD_ROOM, UPWARD_ROOM)).all()
    assert found[0, :, 0].min() > 0.005  # and needs it


def test_wild_commands_stay_within_the_room_and_need_it(make_batch):
    found, swing = surprises(Condition(name="x"), make_batch, wild, count=64, steps=600)
    assert (found.max(axis=(0, 1)) < (FORWARD_ROOM, UPWARD_ROOM)).all()
    assert found[..., 0].max() > 0.01
    assert swing.max() < np.pi / 6


def test_what_is_not_provided_for_exceeds_the_room(make_batch):
    condition = Condition(name="x", disturbance=STRONG)
    config = condition.environment
    reason = Applicability(config, nu_max_filter(config, CERTIFICATE)).configuration_reason
    assert "provides for" in reason or "has room for" in reason
    assert surprises(condition, make_batch)[0][..., 0].max() > FORWARD_ROOM
