from __future__ import annotations

import numpy as np
import pytest

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.baselines.tanner import TannerController
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.contestants import RandomPerEpisode
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.scenarios import Scenario, comparison_scenarios
from defmanip_gym.params import PAPER_DISTURBANCE, BeamParams, DisturbanceParams, TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify

CONFIG = TransportConfig(constraint_mode="cost", disturbance=PAPER_DISTURBANCE)
AT_GOAL = Scenario(name="at goal", seed=1, start=TaskParams().goal)


class Constant:
    """Always full acceleration in one direction."""

    def __init__(self, *action: float) -> None:
        self.action = np.array(action)

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.tile(self.action, (len(observation), 1)), state


def run(controller, scenarios, *, horizon_s=1.0, config=CONFIG, certificate=None, traced=()):
    records, traces = {}, {}

    def keep(record, trace):
        records[record.scenario] = record
        if trace is not None:
            traces[record.scenario] = trace

    rollout(
        "someone",
        controller,
        scenarios,
        config=config,
        horizon_s=horizon_s,
        certificate=certificate,
        traced=traced,
        on_finished=keep,
        on_step=lambda: None,
    )
    return records, traces


@pytest.mark.parametrize(
    "build", [lambda seeds: TannerController(), RandomPerEpisode], ids=["tanner", "random"]
)
def test_a_record_does_not_depend_on_the_rest_of_the_batch(build):
    noisy = TransportConfig(
        constraint_mode="cost",
        disturbance=DisturbanceParams(force_sensor_noise_n=0.1, swing_sensor_noise_rad=0.001),
    )
    scenarios = (*comparison_scenarios(3), AT_GOAL)

    def records_of(batch):
        return run(build([s.seed for s in batch]), batch, config=noisy, horizon_s=2.0)[0]

    together = records_of(scenarios)
    assert together["sampled-01"] == records_of(scenarios[1:2])["sampled-01"]
    assert together["sampled-02"] == records_of(scenarios[:0:-1])["sampled-02"]


def test_nothing_counts_after_the_end_of_an_episode():
    records, _ = run(ZeroController(), (AT_GOAL, *comparison_scenarios(1)))
    assert records["at goal"].outcome == "success"
    assert records["at goal"].duration_s == records["at goal"].time_to_goal_s == 0.02
    assert records["at goal"].path_length_m < 0.01
    assert records["paper"].outcome == "timeout"
    assert records["paper"].duration_s == 1.0


def test_a_violation_goes_on_but_is_no_success():
    records, _ = run(Constant(1.0, 0.0, 0.0), comparison_scenarios(1), horizon_s=1.5)
    record = records["paper"]
    assert record.violated and record.largest_swing_share > 1
    assert record.outcome == "violation" and not record.success
    assert record.duration_s == 1.5


def test_leaving_the_workspace_ends_an_episode():
    records, _ = run(Constant(0.0, 0.0, 1.0), comparison_scenarios(1), horizon_s=5.0)
    assert records["paper"].outcome == "left_workspace"
    assert records["paper"].duration_s < 5.0


def test_the_analytic_controller_reaches_the_goal():
    records, _ = run(TannerController(), comparison_scenarios(1), horizon_s=30.0)
    record = records["paper"]
    assert record.success and record.final_distance_m < 0.05
    assert record.path_length_m > 9.0
    assert 30.0 < record.peak_grasp_force_n < 40.0
    assert record.energy_j > 0


def test_the_wrapper_intervenes_and_is_counted():
    certificate = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)
    full = Constant(1.0, 0.0, 0.0)
    wrapped, traces = run(full, comparison_scenarios(1), certificate=certificate, traced={"paper"})
    record = wrapped["paper"]
    assert record.interventions == 1.0 and record.certificate_applies
    assert record.mean_intervention_m_s2 > 2.0
    assert not record.violated
    applied = np.abs(traces["paper"].action_m_s2[:, 0]).max()
    assert applied <= certificate.acceleration_bound + 1e-9
    assert run(full, comparison_scenarios(1))[0]["paper"].interventions is None


def test_traces_run_at_25_hz_from_start_to_end():
    _, traces = run(
        ZeroController(), (*comparison_scenarios(2), AT_GOAL), traced={"paper", "at goal"}
    )
    assert set(traces) == {"paper", "at goal"}
    trace = traces["paper"]
    np.testing.assert_allclose(np.diff(trace.time_s), 0.04)
    assert trace.time_s[-1] == pytest.approx(1.0)
    assert trace.position_m[0] == pytest.approx((-8.294, 5.5, -0.430), abs=1e-3)
    np.testing.assert_allclose(trace.margin_rad + trace.largest_swing_rad, CONFIG.sigma_rad)
    assert traces["at goal"].time_s.tolist() == [0.0, 0.02]
