"""The ladder's controllers arrive, in batches as alone, and remember their own episodes only."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic import lqr, mpc, shaped
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.conditions import Condition
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.params import BeamParams, DisturbanceParams
from defmanip_gym.payloads.rod import RodPayload

ENV_ID = "defmanip_gym:DeformTransport-v0"
MODULES = {"lqr": lqr, "shaped": shaped, "mpc": mpc}


@pytest.fixture(params=MODULES)
def module(request):
    if request.param == "mpc":
        pytest.importorskip("daqp", reason="mpc needs DAQP: pip install 'defmanip_gym[qp]'")
    return MODULES[request.param]


def records(controller, scenarios, config):
    config = replace(config, inner_loop=controller.inner_loop)
    entry = Entry(suite="test", contestant="ladder", family="analytic")
    episodes = rollout(
        entry,
        controller,
        scenarios,
        config=config,
        horizon_s=20.0,
        delay_periods=scenarios[0].condition.delay_periods,
        nominal_beam=controller.beam,
    )
    return [episode.record for episode in episodes]


def test_it_arrives_from_where_training_starts_within_sigma(module):
    scenarios = suite_named("nominal").scenarios[:6]
    config = scenarios[0].condition.environment
    found = records(module.make_controller(TransportConfig()), scenarios, config)
    assert all(record.success for record in found)
    assert max(record.time_to_goal_s for record in found) < 9.0


@pytest.mark.parametrize(
    "condition",
    [
        Condition(name="light", mass_factor=0.5),
        Condition(name="heavy", mass_factor=2.0),
        Condition(name="pushed", disturbance=DisturbanceParams(force_bias_n=2.0)),
        Condition(name="late", actuation_delay_s=0.02),
    ],
    ids=lambda condition: condition.name,
)
def test_it_arrives_with_what_it_was_not_told(module, condition):
    nominal = suite_named("nominal").scenarios[:3]
    scenarios = [replace(scenario, condition=condition) for scenario in nominal]
    found = records(module.make_controller(TransportConfig()), scenarios, condition.environment)
    assert all(record.success for record in found)


def test_flexible_beams_are_carried_by_the_same_code(module):
    config = TransportConfig(
        payload=RodPayload(beam=BeamParams(segment_count=3)), constraint_mode="cost"
    )
    found = records(module.make_controller(config), suite_named("nominal").scenarios[:2], config)
    assert all(record.success for record in found)


def test_single_and_batched_predictions_are_the_same(module):
    env = gymnasium.make_vec(ENV_ID, num_envs=4)
    controller = module.make_controller(TransportConfig())
    observation, _ = env.reset(seed=3)
    alone, together = [None] * 4, None
    for step in range(20):
        start = np.full(4, step == 0)
        batch, together = controller.predict(observation, together, start)
        for row in range(4):
            single, alone[row] = controller.predict(observation[row], alone[row], start[row])
            np.testing.assert_array_equal(single, batch[row])
        observation, *_ = env.step(batch)


def test_an_episode_that_starts_knows_nothing_of_the_one_before(module):
    env = gymnasium.make_vec(ENV_ID, num_envs=2)
    controller = module.make_controller(TransportConfig())
    first, _ = env.reset(seed=3)
    action, state = controller.predict(first)
    for _ in range(5):
        observation, *_ = env.step(action)
        action, state = controller.predict(observation, state, np.zeros(2, dtype=bool))
    mixed, _ = controller.predict(
        np.stack((first[0], observation[1])), state, np.array([True, False])
    )
    fresh, _ = controller.predict(first)
    np.testing.assert_allclose(mixed[0], fresh[0], atol=1e-12)
    going, _ = controller.predict(observation, state, np.zeros(2, dtype=bool))
    np.testing.assert_allclose(mixed[1], going[1], atol=1e-12)


def test_it_says_what_it_depends_on(module):
    identity = module.make_controller(TransportConfig()).identity
    assert set(identity) >= {"params", "beam", "robot", "task"}
    heavier = TransportConfig(payload=RodPayload(beam=BeamParams(mass_kg=4.0)))
    assert identity != module.make_controller(heavier).identity
