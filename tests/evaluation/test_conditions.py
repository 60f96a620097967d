"""What certificates provide for besides the beam, and that records say where they do not."""

from __future__ import annotations

from dataclasses import replace

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import NOMINAL, suite_named
from defmanip_gym.params import PAPER_DISTURBANCE, DisturbanceParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.nu_max_scaling import nu_max_filter

SCENARIO = suite_named("nominal").scenarios[0]
ENTRY = Entry(suite="nominal", contestant="zero/l1", family="reference")


def flag(condition, certificate):
    (episode,) = rollout(
        ENTRY,
        ZeroController(),
        [replace(SCENARIO, condition=condition)],
        config=condition.environment,
        horizon_s=0.04,
        safety_filter=certificate and nu_max_filter(condition.environment, certificate),
        delay_periods=condition.delay_periods,
    )
    return episode.record.certificate_applies


def test_records_claim_a_certificate_only_where_beam_start_and_condition_are_covered():
    certificate = certify(NOMINAL_BEAM, conditions=TRANSPORT_CONDITIONS)
    assert flag(NOMINAL, certificate) is True
    assert flag(Condition(name="late", actuation_delay_s=0.02), certificate) is False
    assert flag(Condition(name="heavy", mass_factor=1.2), certificate) is False
    assert flag(Condition(name="paper", disturbance=PAPER_DISTURBANCE), certificate) is True
    pushed = DisturbanceParams(force_bias_n=2.0)
    assert flag(Condition(name="pushed", disturbance=pushed), certificate) is False
    blurred = DisturbanceParams(swing_sensor_noise_rad=0.02)
    assert flag(Condition(name="blurred", disturbance=blurred), certificate) is False
    assert flag(Condition(name="late", actuation_delay_s=0.02), None) is None
