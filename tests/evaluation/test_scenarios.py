from __future__ import annotations

import pytest

from defmanip_gym.envs.starts import PAPER_START
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.scenarios import FIRST_EVALUATION_SEED, comparison_scenarios


def test_the_papers_start_comes_first_and_names_and_seeds_are_unique():
    scenarios = comparison_scenarios(24)
    assert (scenarios[0].name, scenarios[0].start) == ("paper", PAPER_START)
    assert len({scenario.name for scenario in scenarios}) == 24
    assert len({scenario.seed for scenario in scenarios}) == 24
    assert len({scenario.start for scenario in scenarios}) == 24
    assert min(scenario.seed for scenario in scenarios) >= FIRST_EVALUATION_SEED


def test_a_smaller_comparison_is_the_beginning_of_a_larger_one():
    assert comparison_scenarios(3) == comparison_scenarios(8)[:3]


def test_no_scenarios_are_refused():
    with pytest.raises(ParameterError, match="episodes"):
        comparison_scenarios(0)
