"""Safety filters against attackers on the plant, and what they foresee against what happens."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.theory.filters.conditions import FilterConditions
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.filter_errors import filter_errors

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "attacks"))
import attack_filters  # noqa: E402


@pytest.mark.parametrize("seed", [1, 2, 11])
def test_attackers_never_exceed_sigma_where_the_filter_applies(seed, monkeypatch):
    monkeypatch.setattr(attack_filters, "EPISODES", 60)
    result = attack_filters.run_case(StorageFilter, seed, steps=150)
    assert result["applies"] == 60
    assert result["broken"] == 0 and result["largest_swing_share"] < 1


def test_attackers_do_exceed_sigma_where_the_level_is_too_high(monkeypatch):
    """The attack can fail the filter: one whose σ is larger lets them pass."""
    monkeypatch.setattr(attack_filters, "EPISODES", 60)
    monkeypatch.setattr(
        attack_filters,
        "filter_for",
        lambda config, **options: StorageFilter(
            config.beam, conditions=FilterConditions(storage_error=0.02)
        ),
    )
    reserved = np.array([-0.3])
    monkeypatch.setattr(
        "defmanip_gym.theory.filters.storage_filter.reserved_shares", lambda *a, **k: reserved
    )
    assert attack_filters.run_case(StorageFilter, 11, steps=150)["largest_swing_share"] > 1


def test_errors_of_the_reference_robot_are_what_filters_provide_for_by_default():
    errors, given = filter_errors(TransportConfig(), StorageFilter()), FilterConditions()
    provided = given.forward_error_m_s2, given.lateral_error_m_s2, given.vertical_error_m_s2
    assert all(
        0.7 * room < found <= room
        for found, room in zip(errors.acceleration_m_s2, provided, strict=True)
    )
    assert errors.storage <= given.storage_error


def test_a_robot_that_believes_another_beam_makes_larger_errors():
    made = StorageFilter()
    wrong = replace(BeamParams(), mass_kg=1.2 * BeamParams().mass_kg, damping=0.0)
    believing = filter_errors(
        TransportConfig(payload=RodPayload(nominal_beam=wrong)), made
    ).acceleration_m_s2
    assert max(believing) > 3 * max(filter_errors(TransportConfig(), made).acceleration_m_s2)
