"""A residual corrects the paper's controller and never leaves its certificate."""

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.baselines.residual import ResidualController, corrected
from defmanip_gym.baselines.residual_action import ResidualAction, ResidualVectorAction
from defmanip_gym.baselines.residual_base import certified_authority
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

ID = "defmanip_gym:DeformTransport-v0"


def make(autoreset_mode="SameStep", **arguments):
    return gymnasium.make_vec(ID, autoreset_mode=autoreset_mode, **arguments)


@pytest.fixture(scope="module")
def certificate():
    return certify(BeamParams(), method="phase_plane", conditions=TRANSPORT_CONDITIONS)


class Constant:
    """Asks for the same action always."""

    def __init__(self, *action):
        self.action = np.array(action)

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.broadcast_to(self.action, (*observation.shape[:-1], 3)), state


def test_correction_is_limited_in_itself_and_with_the_base():
    base = np.array([[0.9, 0.0, -1.0]])
    assert corrected(base, np.array([[5.0, -0.5, -1.0]]), 0.2) == pytest.approx(
        np.array([[1.0, -0.1, -1.0]])
    )


def test_zero_residual_leaves_the_papers_controller_alone(certificate):
    envs = make(num_envs=3)
    observation, _ = envs.reset(seed=0)
    base = TannerController(certificate=certificate)
    both = ResidualController(base, ZeroController(), authority=0.5, decision_periods=4)
    plain, plain_state = base.predict(observation)
    action, (below, *_) = both.predict(observation)
    assert action == pytest.approx(plain)
    assert all(np.array_equal(a, b) for a, b in zip(below, plain_state, strict=True))
    envs.close()


class Counting:
    """Asks for as much as it has been called."""

    def __init__(self):
        self.calls = 0.0

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.calls += 1.0
        return np.full((*observation.shape[:-1], 3), 0.1 * self.calls), state


def test_a_decision_is_held_and_made_anew_where_an_episode_starts():
    controller = ResidualController(ZeroController(), Counting(), authority=1.0, decision_periods=3)
    state, held = None, []
    for step in range(7):
        start = np.array([False, step == 2])
        action, state = controller.predict(np.zeros((2, 22)), state, start)
        held.append(action[:, 0].tolist())
    first, second = np.round(10 * np.array(held).T).astype(int).tolist()
    assert first == [1, 1, 1, 4, 4, 4, 7]
    assert second == [1, 1, 3, 3, 3, 6, 6]


def test_training_environment_does_what_the_controller_does_later(certificate):
    """Residual actions in the wrapper, and the same policy as a controller, move alike."""
    residual = Constant(0.7, -0.2, 0.1)
    training = ResidualVectorAction(
        make(num_envs=2, max_episode_steps=40), decision_periods=5, authority=2.0
    )
    later = NuMaxVectorActionScaling(make(num_envs=2, max_episode_steps=40), certificate)
    controller = ResidualController(
        TannerController(certificate=certificate, params=GENTLE_PARAMS),
        residual,
        authority=certified_authority(certificate, TransportConfig(), 2.0),
        decision_periods=5,
    )
    trained, _ = training.reset(seed=3)
    seen, _ = later.reset(seed=3)
    state, start = None, np.ones(2, dtype=bool)
    for _ in range(18):  # over two resets
        rewards = np.zeros(2)
        for _ in range(5):
            actions, state = controller.predict(seen, state, start)
            seen, reward, terminated, truncated, _ = later.step(actions)
            start = terminated | truncated
            rewards += reward
        trained, told, *_ = training.step(residual.predict(trained)[0])
        assert trained == pytest.approx(seen, abs=1e-12)
        assert told == pytest.approx(rewards, abs=1e-12)
    training.close()
    later.close()


def test_an_ending_amid_a_decision_is_told_with_its_last_observation_and_cost():
    """Episodes of 7 periods, decisions of 5: every other one is cut after 2 periods."""
    env = make(num_envs=2, max_episode_steps=7, constraint_mode="cost")
    training = ResidualVectorAction(env, decision_periods=5)
    plain = ResidualVectorAction(make(num_envs=2, max_episode_steps=7))
    training.reset(seed=1)
    plain.reset(seed=1)
    actions = np.full((2, 3), 0.5)
    *_, truncated, info = training.step(actions)
    assert not truncated.any() and "final_obs" not in info
    *_, truncated, info = training.step(actions)
    assert truncated.all()
    for _ in range(7):
        *_, last = plain.step(actions)
    assert info["final_obs"] == pytest.approx(last["final_obs"], abs=1e-12)
    assert info["final_info"]["cost"].tolist() == [0.0, 0.0]
    training.close()
    plain.close()


def test_single_and_batched_wrapper_agree():
    single = ResidualAction(gymnasium.make(ID), decision_periods=3)
    batch = ResidualVectorAction(make(num_envs=1), decision_periods=3)
    one, _ = single.reset(seed=5)
    many, _ = batch.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(60):
        action = rng.uniform(-1, 1, 3)
        one, *_ = single.step(action)
        many, *_ = batch.step(action[None])
        assert one == pytest.approx(many[0], abs=1e-12)
    single.close()
    batch.close()


def test_wildest_residual_stays_within_sigma():
    env = ResidualVectorAction(make(num_envs=8, max_episode_steps=600), authority=15.0)
    _, info = env.reset(seed=0)
    smallest = info["constraint_margin"].min()
    for step in range(500):
        sign = 1.0 if (step // 35) % 2 else -1.0  # half a period of the swing
        _, _, _, _, info = env.step(np.full((8, 3), sign))
        smallest = min(smallest, info["constraint_margin"].min())
    assert 0 < smallest < 0.9 * np.pi / 6  # it swings, and not beyond σ
    env.close()


def test_batches_that_reset_otherwise_are_refused():
    env = make(num_envs=2, autoreset_mode="NextStep")
    with pytest.raises(ParameterError, match="SAME_STEP"):
        ResidualVectorAction(env)
    env.close()


@pytest.mark.parametrize("authority", [0.0, 1.5, float("nan")])
def test_impossible_authority_is_refused(authority):
    with pytest.raises(ParameterError, match="authority"):
        ResidualController(
            ZeroController(), ZeroController(), authority=authority, decision_periods=1
        )
