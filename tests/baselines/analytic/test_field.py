"""The field's controller arrives with plants that it does not believe in."""

from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.field import FieldController, FieldParams, make_controller
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import GainError, ParameterError
from defmanip_gym.evaluation.conditions import NOMINAL, Condition
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.params import BeamParams
from defmanip_gym.payloads.rod import RodPayload

MODEL = FieldParams(inner_loop="model")


def records(condition, params=None, starts=4):
    controller = FieldController(params=params)
    scenarios = suite_named("nominal").scenarios[:starts]
    episodes = rollout(
        Entry(suite="nominal", contestant="field", family="analytic"),
        controller,
        [replace(scenario, condition=condition) for scenario in scenarios],
        config=condition.environment_on(controller.inner_loop),
        horizon_s=15.0,
        delay_periods=condition.delay_periods,
    )
    return [episode.record for episode in episodes]


@pytest.mark.parametrize(
    "condition",
    [
        NOMINAL,
        Condition(name="light", mass_factor=0.5),
        Condition(name="heavy", mass_factor=2.0),
        Condition(name="long, hardly damped", length_factor=1.2, damping_factor=0.1),
        Condition(name="short, damped", length_factor=0.8, damping_factor=10.0),
        *(c for c in suite_named("disturbed").conditions if c.name in ("delay-60ms", "all")),
    ],
    ids=lambda condition: condition.name,
)
def test_it_arrives_with_any_of_these_plants_in_the_same_time(condition):
    for record in records(condition):
        assert record.success
        assert record.time_to_goal_s < 10.0


def test_on_the_models_inner_loop_the_first_reading_saves_a_mass_that_is_off_by_a_fifth():
    heavy = Condition(name="heavy", mass_factor=1.2)
    assert all(record.success for record in records(heavy, MODEL))


def test_single_and_batched_predictions_agree_and_memory_starts_anew():
    rng = np.random.default_rng(0)
    controller = FieldController(params=MODEL)
    observations = rng.normal(size=(3, controller.layout.size))
    fresh, state = controller.predict(observations)
    for observation, action in zip(observations, fresh, strict=True):
        single, _ = controller.predict(observation)
        assert single.shape == (3,)
        np.testing.assert_array_equal(single, action)
    again, _ = controller.predict(observations, state, np.array([True, False, True]))
    np.testing.assert_array_equal(again[[0, 2]], fresh[[0, 2]])
    assert not np.array_equal(again[1], fresh[1])


def test_it_is_made_for_the_inner_loop_that_measures_the_force():
    made = make_controller(TransportConfig())
    assert made.inner_loop == "measured_force"
    assert made.identity["params"]["observer_gain_per_s"] == FieldParams().observer_gain_per_s


@pytest.mark.parametrize("segments", [1, 3, 8])
def test_it_needs_no_other_gains_for_more_segments(segments):
    FieldController(payload=RodPayload(beam=BeamParams(segment_count=segments)))


def test_gains_that_grow_and_values_without_sense_are_refused():
    with pytest.raises(GainError, match="spectral radius"):
        FieldController(params=FieldParams(observer_gain_per_s=120.0))
    with pytest.raises(ParameterError, match="inner_loop"):
        FieldParams(inner_loop="guess")
    with pytest.raises(ParameterError, match="params"):
        FieldController(params=5)
