"""Filters reckon with the errors of the inner loop at hand, and apply on no other without room."""

import gymnasium
import numpy as np

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.params import BeamParams, BeamRanges
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

BEAM = BeamParams()
HALF_TO_TWICE = {
    "beam_ranges": BeamRanges(mass_kg=(0.5 * BEAM.mass_kg, 2.0 * BEAM.mass_kg)),
    "nominal_beam": BeamParams(damping=0.0),
}


def environment(inner_loop, **arguments):
    arguments = {"constraint_mode": "cost", "autoreset_mode": "Disabled"} | arguments
    return gymnasium.make_vec(ENV_ID, num_envs=16, inner_loop=inner_loop, **arguments)


def test_masses_from_half_to_twice_cost_a_filter_little_where_the_force_is_measured_only():
    feeling, believing = (
        environment(kind, **HALF_TO_TWICE) for kind in ("measured_force", "model")
    )
    made = filter_for(feeling.unwrapped.config)
    assert filter_for(believing.unwrapped.config).level_share < 0.2 < 0.85 < made.level_share
    wrapped = SafetyFilterVectorWrapper(feeling, made)
    observation, info = wrapped.reset(seed=0)
    assert info["filter_applies"].all()
    for step in range(150):  # feed the swing, lift and turn
        pushes = np.where(observation[:, 15] < 0, 1.0, -1.0)
        wild = np.full(16, 1.0 if step // 9 % 2 else -1.0)
        observation, _, _, _, info = wrapped.step(np.stack((pushes, wild, 0.3 * wild), axis=1))
        assert (info["constraint_margin"] >= 0)[info["filter_applies"]].all()


def test_a_filter_for_the_other_inner_loop_says_that_its_errors_have_no_room():
    made = filter_for(environment("model").unwrapped.config)
    assert isinstance(made, StorageFilter)
    wrapped = SafetyFilterVectorWrapper(environment("measured_force"), made)
    _, info = wrapped.reset(seed=0)
    assert not info["filter_applies"].any()
    assert "the filter provides for" in info["filter_reason"][0]
