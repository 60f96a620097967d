"""The shaper leaves less swing than its reference alone would, and refuses nonsense."""

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.shaped import ShapedController, ShapedParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import GainError, ParameterError
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import NOMINAL as CONDITION
from defmanip_gym.evaluation.suites import PAPER_START, Scenario
from defmanip_gym.params import BeamParams

SCENARIO = Scenario(name="paper", seed=0, start=PAPER_START, condition=CONDITION)


def swings(controller):
    """Return the largest swing over time from the paper's start, rad."""
    (episode,) = rollout(
        Entry(suite="test", contestant="shaped", family="analytic"),
        controller,
        [SCENARIO],
        config=TransportConfig(constraint_mode="cost", inner_loop=controller.inner_loop),
        horizon_s=6.0,
        traced=("paper",),
    )
    return np.asarray(episode.trace.largest_swing_rad)


def test_it_swings_less_than_the_same_motion_unshaped():
    shaped, unshaped = ShapedController(), ShapedController()
    unshaped.weights = np.ones(1)
    assert swings(shaped).max() < 0.6 * swings(unshaped).max()


def test_an_object_that_does_not_oscillate_is_refused():
    with pytest.raises(GainError, match="oscillates"):
        ShapedController(beam=BeamParams(damping=50.0))


def test_wrong_choices_are_refused():
    with pytest.raises(ParameterError, match="shaper"):
        ShapedParams(shaper="zvx")
