"""The receding horizon keeps the swing where it is told, and goes on where its solver fails."""

import sys

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic.mpc import MpcController, MpcParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import InstallationError, ParameterError
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import suite_named

ENV_ID = "defmanip_gym:DeformTransport-v0"


@pytest.fixture
def daqp():
    return pytest.importorskip("daqp", reason="mpc needs DAQP: pip install 'defmanip_gym[qp]'")


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_the_swing_keeps_to_its_share_of_sigma(daqp, share):
    (scenario,) = suite_named("nominal").scenarios[:1]
    controller = MpcController(params=MpcParams(sigma_share=share))
    (episode,) = rollout(
        Entry(suite="test", contestant="mpc", family="analytic"),
        controller,
        [scenario],
        config=TransportConfig(constraint_mode="cost", inner_loop=controller.inner_loop),
        horizon_s=20.0,
    )
    assert episode.record.success
    assert share - 0.05 < episode.record.largest_swing_share < share + 0.02


def test_without_a_plan_it_tracks_the_field(daqp, monkeypatch):
    controller = MpcController()
    observation, _ = gymnasium.make_vec(ENV_ID, num_envs=2).reset(seed=3)
    planned, _ = controller.predict(observation)
    solve, calls = controller.program._solve, []

    def fails_at_first(*arguments, **settings):
        calls.append(arguments)
        best, value, flag, info = solve(*arguments, **settings)
        return best, value, flag if len(calls) > 1 else -1, info

    monkeypatch.setattr(controller.program, "_solve", fails_at_first)
    action, state = controller.predict(observation)
    np.testing.assert_allclose(action[1], planned[1])
    assert np.isfinite(action[0]).all() and action[0, 0] > 0.5
    assert not state[-1][0].any()


def test_without_its_solver_it_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)  # as if it were not installed
    with pytest.raises(InstallationError, match=r"defmanip_gym\[qp\]"):
        MpcController()


def test_wrong_choices_are_refused():
    with pytest.raises(ParameterError, match="blocks"):
        MpcParams(blocks=(1, 0))
    with pytest.raises(ParameterError, match="sigma_share"):
        MpcParams(sigma_share=1.5)
