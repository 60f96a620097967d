"""What certificates provide for besides the beam, and that records say where they do not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import NOMINAL, SUITES, suite_named
from defmanip_gym.params import PAPER_DISTURBANCE, DisturbanceParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify

SCENARIO = suite_named("nominal").scenarios[0]
ENTRY = Entry(suite="nominal", contestant="zero/l1", family="reference")


def flag(condition, certificate):
    (episode,) = rollout(
        ENTRY,
        ZeroController(),
        [replace(SCENARIO, condition=condition)],
        config=condition.environment,
        horizon_s=0.04,
        certificate=certificate,
        delay_periods=condition.delay_periods,
    )
    return episode.record.certificate_applies


def test_of_the_suites_the_disturbed_one_is_beyond_every_certificate():
    for suite in SUITES:
        within = {condition.within_certificate_conditions for condition in suite.conditions}
        assert within == {suite.name != "disturbed"}


@pytest.mark.parametrize(
    "change",
    [
        {"force_bias_n": -0.06},
        {"force_amplitude_n": 0.006},
        {"force_frequency_rad_s": 2.0},
        {"force_sensor_noise_n": 0.01},
        {"swing_sensor_noise_rad": 1e-3},
    ],
)
def test_more_than_the_papers_disturbance_is_not_provided_for(change):
    assert Condition(name="x", disturbance=PAPER_DISTURBANCE).within_certificate_conditions
    stronger = replace(PAPER_DISTURBANCE, **change)
    assert not Condition(name="x", disturbance=stronger).within_certificate_conditions


def test_a_frequency_without_amplitude_is_none():
    still = DisturbanceParams(force_frequency_rad_s=50.0)
    assert Condition(name="x", disturbance=still).within_certificate_conditions


def test_records_claim_a_certificate_only_where_beam_start_and_condition_are_covered():
    certificate = certify(NOMINAL_BEAM, conditions=TRANSPORT_CONDITIONS)
    assert flag(NOMINAL, certificate) is True
    assert flag(Condition(name="late", actuation_delay_s=0.02), certificate) is False
    assert flag(Condition(name="heavy", mass_factor=1.2), certificate) is False
    assert flag(Condition(name="late", actuation_delay_s=0.02), None) is None
