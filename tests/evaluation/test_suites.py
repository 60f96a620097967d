"""Suites are what they say, the same for ever, and apart from training."""

from __future__ import annotations

import numpy as np
import pytest

from defmanip_gym.envs.starts import PAPER_START, check_starts
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED, VALIDATION_SEED, training_seed
from defmanip_gym.evaluation.suites import SUITE_NAMES, SUITES, suite_named
from defmanip_gym.params import PAPER_DISTURBANCE
from defmanip_gym.task_params import StartParams

# Another digest is another suite: old results cannot be compared with new ones.
DIGESTS = {
    "nominal": "daa377bc3e0e41c8",
    "paper": "a03d89e8fe082772",
    "mismatch": "fcf231d8a2e52673",
    "disturbed": "2bb008ba6614ff92",
    "far": "59c6dcb644616571",
    "payload": "586d7edb3f3e4902",
}


@pytest.mark.parametrize("suite", SUITES, ids=SUITE_NAMES)
def test_nobody_changes_a_suite_unnoticed(suite):
    assert suite.digest[:16] == DIGESTS[suite.name]


@pytest.mark.parametrize("suite", SUITES, ids=SUITE_NAMES)
def test_every_start_can_be_taken_and_every_name_is_unique(suite):
    names = [scenario.name for scenario in suite.scenarios]
    assert len(set(names)) == len(names)
    assert not any("/" in name for name in names)
    for condition in suite.conditions:
        starts = np.array([scenario.start for scenario in suite.of(condition)])
        check_starts(starts, condition.environment)


def test_no_seed_is_used_twice_or_in_training():
    seeds = [scenario.seed for suite in SUITES for scenario in suite.scenarios]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) >= FIRST_EVALUATION_SEED > VALIDATION_SEED + 4096
    largest_run_seed = FIRST_EVALUATION_SEED - 1
    for run_seed in (0, 1, 899, 900, largest_run_seed):
        assert training_seed(run_seed) + 4096 <= VALIDATION_SEED


def test_sizes_and_conditions():
    count = {suite.name: len(suite.scenarios) for suite in SUITES}
    assert count == {
        "nominal": 64, "paper": 2, "mismatch": 64, "disturbed": 56, "far": 48, "payload": 32
    }  # fmt: skip
    for name in ("mismatch", "disturbed", "payload"):
        suite = suite_named(name)
        assert {len(suite.of(condition)) for condition in suite.conditions} == {8}


def test_nominal_starts_are_in_the_training_box():
    params = StartParams()
    starts = np.array([scenario.start for scenario in suite_named("nominal").scenarios])
    offset = np.abs(starts - params.center)
    assert (offset <= np.array(params.spread) + 1e-6).all()
    assert (offset.max(axis=0) > 0.9 * np.array(params.spread)).all()


def test_the_papers_start_comes_with_its_disturbance_and_both_dampings():
    suite = suite_named("paper")
    assert all(scenario.start == PAPER_START for scenario in suite.scenarios)
    assert [condition.disturbance for condition in suite.conditions] == [PAPER_DISTURBANCE] * 2
    assert [condition.beam.damping for condition in suite.conditions] == [0.1, 1.0]


def test_far_starts_are_outside_the_training_box_in_all_directions():
    starts = np.array([scenario.start for scenario in suite_named("far").scenarios])
    distance = np.hypot(starts[:, 0], starts[:, 1])
    assert distance.min() >= 12.0 and distance.max() <= 18.0
    for angle in (np.arctan2(starts[:, 1], starts[:, 0]), starts[:, 2]):
        counts, _ = np.histogram(angle, bins=4, range=(-np.pi, np.pi))
        assert counts.min() >= 10


@pytest.mark.parametrize("suite", SUITES, ids=SUITE_NAMES)
def test_whatever_is_carried_everybody_believes_the_nominal_beam(suite):
    for condition in suite.conditions:
        config = condition.environment
        assert config.constraint_mode == "cost"
        believed = config.believed_beam
        assert believed.damping == 0.0
        assert (believed.mass_kg, believed.length_m) == (
            NOMINAL_BEAM.mass_kg,
            NOMINAL_BEAM.length_m,
        )


def test_mismatched_beams_differ_from_the_nominal_one_by_their_factors():
    beams = {c.name: c.beam for c in suite_named("mismatch").conditions}
    assert beams["damping-x0.1"].damping == pytest.approx(0.01)
    assert beams["mass-x1.2"].mass_kg == pytest.approx(1.2 * NOMINAL_BEAM.mass_kg)
    assert beams["length-x0.8"].length_m == pytest.approx(0.8 * NOMINAL_BEAM.length_m)


def test_the_first_scenarios_are_those_of_each_condition():
    suite = suite_named("mismatch")
    short = suite.first(2)
    assert short.conditions == suite.conditions
    for condition in suite.conditions:
        assert short.of(condition) == suite.of(condition)[:2]
    assert suite.first(1000) == suite
    with pytest.raises(ParameterError, match="episodes"):
        suite.first(0)


def test_a_typo_gets_the_names():
    with pytest.raises(ParameterError, match="'nominal', 'paper', 'mismatch', 'disturbed', 'far'"):
        suite_named("nomnial")


@pytest.mark.parametrize(
    "change", [{"damping_factor": 0.0}, {"mass_factor": -1.0}, {"actuation_delay_s": 0.03}]
)
def test_impossible_conditions_are_refused(change):
    with pytest.raises(ParameterError, match=next(iter(change))):
        Condition(name="x", **change)
