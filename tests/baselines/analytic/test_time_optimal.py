"""Plans that are followed on the plant."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.time_optimal import TimeOptimalController
from defmanip_gym.baselines.analytic.time_optimal_params import TimeOptimalParams
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import InstallationError, ParameterError
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.optimum import optimum_share
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.params import BeamParams
from defmanip_gym.planning.plan_file import shipped_plans
from defmanip_gym.task_params import TaskParams
from defmanip_gym.wrappers.filter_for import filter_for

ENTRY = Entry(suite="nominal", contestant="time_optimal", family="analytic")


def records(suite, count, *, filtered=False):
    scenarios = suite_named(suite).scenarios[:count]
    controller = TimeOptimalController()
    config = scenarios[0].condition.environment_on(controller.inner_loop)
    episodes = rollout(
        ENTRY,
        controller,
        scenarios,
        config=config,
        horizon_s=20.0,
        safety_filter=filter_for(config) if filtered else None,
    )
    return [episode.record for episode in episodes]


@pytest.mark.parametrize(("suite", "filtered"), [("nominal", True), ("far", True)])
def test_plans_can_be_driven_almost_as_fast_as_possible(suite, filtered):
    for record in records(suite, 4, filtered=filtered):
        assert record.success and not record.violated
        assert 1.0 < 1 / optimum_share(record) < 1.1


def steps_of(controller, env, starts, count):
    observation, _ = env.reset(options={"start": starts})
    state, begins, actions = None, np.ones(len(starts), dtype=bool), []
    for _ in range(count):
        action, state = controller.predict(observation, state, begins)
        begins = np.zeros_like(begins)
        actions.append(action)
        observation, *_ = env.step(action)
    return np.array(actions), observation, state


@pytest.fixture(scope="module")
def starts():
    return np.array([scenario.start for scenario in suite_named("nominal").scenarios[:3]])


def test_an_episode_does_not_depend_on_its_batch(starts):
    controller = TimeOptimalController()
    together, *_ = steps_of(controller, DeformTransportVectorEnv(3), starts, 20)
    alone, *_ = steps_of(TimeOptimalController(), DeformTransportVectorEnv(1), starts[1:2], 20)
    np.testing.assert_array_equal(together[:, 1], alone[:, 0])


def test_a_state_goes_on_in_another_controller(starts):
    env = DeformTransportVectorEnv(3)
    controller = TimeOptimalController()
    _, observation, state = steps_of(controller, env, starts, 20)
    assert all(isinstance(part, np.ndarray) for part in state)
    expected, _ = controller.predict(observation, state)
    found, _ = TimeOptimalController().predict(observation, state)
    np.testing.assert_array_equal(found, expected)


def test_an_episode_that_starts_within_a_batch_gets_its_own_plan(starts):
    env = DeformTransportVectorEnv(3)
    controller = TimeOptimalController()
    _, observation, state = steps_of(controller, env, starts, 20)
    first, _ = env.reset(options={"start": starts})
    mixed = np.where(np.array([[False], [True], [False]]), first, observation)
    action, (*_, origins, steps) = controller.predict(mixed, state, np.array([False, True, False]))
    fresh, _ = TimeOptimalController().predict(first[1:2], None)
    np.testing.assert_array_equal(action[1], fresh[0])
    assert steps.tolist() == [21, 1, 21]
    np.testing.assert_array_equal(origins[[0, 2]], state[-2][[0, 2]])


def test_unknown_starts_are_planned_for_when_they_come():
    pytest.importorskip("casadi")
    start = np.array([[-3.0, 1.0, 0.2, math.pi / 3, -math.pi / 2, 0.0]])
    env = DeformTransportVectorEnv(1)
    observation, _ = env.reset(options={"start": start})
    controller, state = TimeOptimalController(), None
    is_there = False
    while not is_there and (state is None or state[-1].item() < 200):
        action, state = controller.predict(observation, state)
        observation, *_, info = env.step(action)
        is_there = info["is_success"][0]
    assert is_there and state[-1].item() > 100


def test_without_casadi_unknown_starts_end_in_a_message(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    env = DeformTransportVectorEnv(1)
    observation, _ = env.reset(
        options={"start": np.array([[-4.0, 1.1, 0.2, math.pi / 3, -math.pi / 2, 0.0]])}
    )
    params = TimeOptimalParams()
    search = replace(params.search, fine_intervals=37, coarse_intervals=23)  # none in memory
    controller = TimeOptimalController(params=replace(params, search=search))
    with pytest.raises(InstallationError, match=r"defmanip_gym\[plan\]"):
        controller.predict(observation)


def test_stored_plans_are_taken_only_for_what_they_were_made_for():
    assert TimeOptimalController().tracks.stored is shipped_plans()
    for other in (
        {"beam": BeamParams(length_m=0.5)},
        {"task": TaskParams(max_speed_m_s=1.5)},
        {"sigma_rad": 0.4},
    ):
        assert not TimeOptimalController(**other).tracks.stored.plans


def test_plans_that_were_lost_are_made_anew(starts):
    pytest.importorskip("casadi")
    params = TimeOptimalParams(replans=True, lost_m=0.3)
    controller = TimeOptimalController(params=params)
    env = DeformTransportVectorEnv(3)
    _, observation, (*rest, origins, _) = steps_of(controller, env, starts, 20)
    far_on = np.array([20, 120, 20])  # the second one is not where it should be by now
    _, (*_, origins, steps) = controller.predict(observation, (*rest, origins, far_on))
    assert steps.tolist() == [21, 1, 21]
    assert origins[1, 4] != 0.0


def test_payloads_of_another_mass_arrive_all_the_same():
    heavy = [s for s in suite_named("payload").scenarios if s.condition.name == "mass-x2"][:2]
    controller = TimeOptimalController()
    config = heavy[0].condition.environment_on(controller.inner_loop)
    for episode in rollout(ENTRY, controller, heavy, config=config, horizon_s=20.0):
        assert episode.record.success


def test_several_segments_are_refused():
    with pytest.raises(ParameterError, match="rigid rods"):
        TimeOptimalController(beam=BeamParams(segment_count=2))


def test_arguments_may_be_mappings_and_others_are_refused():
    made = TimeOptimalController(params={"lost_m": 0.3})
    assert made.params == TimeOptimalParams(lost_m=0.3)
    with pytest.raises(ParameterError, match="params"):
        TimeOptimalController(params=5)
    with pytest.raises(ParameterError, match="plans"):
        TimeOptimalController(plans=5)
