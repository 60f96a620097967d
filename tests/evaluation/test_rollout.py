from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.tanner import TannerController
from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.envs.starts import PAPER_START
from defmanip_gym.evaluation.conditions import NOMINAL, NOMINAL_BEAM, Condition
from defmanip_gym.evaluation.controllers import RandomPerEpisode
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import Scenario, suite_named
from defmanip_gym.params import PAPER_DISTURBANCE, DisturbanceParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.nu_max_scaling import nu_max_filter

PAPER = Condition(name="paper", disturbance=PAPER_DISTURBANCE)
CONFIG = PAPER.environment
PAPER_SCENARIO = Scenario(name="paper", seed=2, start=PAPER_START, condition=PAPER)
AT_GOAL = Scenario(name="at goal", seed=1, start=TaskParams().goal, condition=PAPER)
SAMPLED = suite_named("nominal").scenarios[:2]
ENTRY = Entry(suite="nominal", contestant="someone", family="learned", member="7")


class Constant:
    """Always full acceleration in one direction."""

    def __init__(self, *action: float) -> None:
        self.action = np.array(action)

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.tile(self.action, (len(observation), 1)), state


def run(controller, scenarios, *, horizon_s=1.0, config=CONFIG, **arguments):
    episodes = rollout(
        ENTRY, controller, scenarios, config=config, horizon_s=horizon_s, **arguments
    )
    assert [e.record.scenario for e in episodes] == [scenario.name for scenario in scenarios]
    records = {episode.record.scenario: episode.record for episode in episodes}
    traces = {e.trace.scenario: e.trace for e in episodes if e.trace is not None}
    return records, traces


@pytest.mark.parametrize("delay_periods", [0, 3])
@pytest.mark.parametrize(
    "build", [lambda seeds: TannerController(), RandomPerEpisode], ids=["tanner", "random"]
)
def test_a_record_does_not_depend_on_the_rest_of_the_batch(build, delay_periods):
    disturbance = DisturbanceParams(force_sensor_noise_n=0.1, swing_sensor_noise_rad=0.001)
    noisy = replace(CONFIG, disturbance=disturbance)
    certificate = certify(NOMINAL_BEAM, conditions=TRANSPORT_CONDITIONS)
    scenarios = (*SAMPLED, PAPER_SCENARIO, AT_GOAL)

    def records_of(batch, **arguments):
        controller = build([scenario.seed for scenario in batch])
        enforced = nu_max_filter(noisy, certificate)
        settings = dict(config=noisy, horizon_s=2.0, safety_filter=enforced)
        return run(controller, batch, delay_periods=delay_periods, **settings, **arguments)[0]

    together = records_of(scenarios, num_threads=2)
    for index, name in ((0, "nominal-00"), (1, "nominal-01")):
        assert together[name] == records_of(scenarios[index : index + 1])[name]
    assert together["nominal-01"] == records_of(scenarios[:0:-1], num_threads=1)["nominal-01"]


def test_records_say_whose_they_are():
    record = run(ZeroController(), SAMPLED)[0]["nominal-01"]
    assert (record.suite, record.contestant, record.member) == ("nominal", "someone", "7")
    assert (record.condition, record.family, record.seed) == ("nominal", "learned", 1_000_001)
    assert record.start == SAMPLED[1].start and record.speed_limit_m_s == 2.0


def test_nothing_counts_after_the_end_of_an_episode():
    records, _ = run(ZeroController(), (AT_GOAL, PAPER_SCENARIO))
    assert records["at goal"].outcome == "success"
    assert records["at goal"].duration_s == records["at goal"].time_to_goal_s == 0.02
    assert records["at goal"].path_length_m < 0.01
    assert records["paper"].outcome == "timeout"
    assert records["paper"].duration_s == 1.0


def test_a_violation_goes_on_but_is_no_success():
    records, _ = run(Constant(1.0, 0.0, 0.0), [PAPER_SCENARIO], horizon_s=1.5)
    record = records["paper"]
    assert record.violated and record.largest_swing_share > 1
    assert record.outcome == "violation" and not record.success and record.score == 0.0
    assert record.duration_s == 1.5


def test_leaving_the_workspace_ends_an_episode():
    records, _ = run(Constant(0.0, 0.0, 1.0), [PAPER_SCENARIO], horizon_s=5.0)
    assert records["paper"].outcome == "left_workspace"
    assert records["paper"].duration_s < 5.0


def test_the_analytic_controller_reaches_the_goal():
    records, _ = run(TannerController(), [PAPER_SCENARIO], horizon_s=30.0)
    record = records["paper"]
    assert record.success and record.final_distance_m < 0.05
    assert record.path_length_m > 9.0
    assert record.score == pytest.approx(record.start_distance_m / record.time_to_goal_s / 2.0)
    assert 30.0 < record.peak_grasp_force_n < 45.0  # the weight, and 3 m/s² of a part of it
    assert record.energy_j > 0


def test_the_wrapper_intervenes_and_is_counted():
    certificate = certify(NOMINAL_BEAM, conditions=TRANSPORT_CONDITIONS)
    full = Constant(1.0, 0.0, 0.0)
    enforced = nu_max_filter(CONFIG, certificate)
    wrapped, traces = run(full, [PAPER_SCENARIO], safety_filter=enforced, traced={"paper"})
    record = wrapped["paper"]
    assert record.interventions == 1.0 and record.certificate_applies
    assert record.mean_intervention_m_s2 > 2.0
    assert not record.violated
    applied = np.abs(traces["paper"].action_m_s2[:, 0]).max()
    assert applied <= certificate.acceleration_bound + 1e-9
    assert (traces["paper"].requested_m_s2[:, 0] == 3.0).all()
    assert run(full, [PAPER_SCENARIO])[0]["paper"].interventions is None


def test_the_force_is_that_of_the_nominal_object_unless_the_object_is_another():
    forward = Constant(0.1, 0.0, 0.0)
    scenario = replace(PAPER_SCENARIO, condition=NOMINAL)

    def error(condition, **arguments):
        scenarios = [replace(scenario, condition=condition)]
        return run(forward, scenarios, config=condition.environment, **arguments)[0][
            "paper"
        ].force_error_n

    heavier = Condition(name="x", mass_factor=1.2)
    assert error(NOMINAL) < 0.05
    # a fifth of the weight is 6.1 N; part of it the arm gives way to
    assert 1.0 < error(heavier) < 6.1
    noisy = Condition(name="x", disturbance=DisturbanceParams(force_sensor_noise_n=0.5))
    assert error(noisy, horizon_s=4.0) == pytest.approx(0.5 * np.sqrt(3), rel=0.1)


def test_a_delay_keeps_actions_from_taking_effect():
    forward = Constant(0.1, 0.0, 0.0)
    _, traces = run(forward, [PAPER_SCENARIO], delay_periods=4, traced={"paper"}, horizon_s=0.4)
    trace = traces["paper"]
    np.testing.assert_allclose(trace.requested_m_s2[:, 0], 0.3)
    np.testing.assert_allclose(trace.action_m_s2[:, 0], np.where(trace.time_s < 0.08, 0.0, 0.3))


def test_traces_run_at_25_hz_from_start_to_end():
    scenarios = (PAPER_SCENARIO, *SAMPLED, AT_GOAL)
    _, traces = run(ZeroController(), scenarios, traced={"paper", "at goal"})
    assert set(traces) == {"paper", "at goal"}
    trace = traces["paper"]
    np.testing.assert_allclose(np.diff(trace.time_s), 0.04)
    assert trace.time_s[-1] == pytest.approx(1.0)
    assert trace.position_m[0] == pytest.approx((-8.294, 5.5, -0.430), abs=1e-3)
    assert trace.base_pose[0] == pytest.approx(PAPER_START[:3])
    assert trace.joints_rad[0] == pytest.approx(PAPER_START[3:5])
    np.testing.assert_allclose(trace.margin_rad + trace.largest_swing_rad, CONFIG.sigma_rad)
    np.testing.assert_allclose(np.abs(trace.swing_rad[:, 0]), trace.largest_swing_rad)
    assert traces["at goal"].time_s.tolist() == [0.0, 0.02]


def test_traces_show_the_swing_and_not_its_sensors_noise():
    config = replace(CONFIG, disturbance=DisturbanceParams(swing_sensor_noise_rad=0.05))
    _, traces = run(ZeroController(), [PAPER_SCENARIO], config=config, traced={"paper"})
    assert np.abs(traces["paper"].swing_rad).max() < 1e-3
