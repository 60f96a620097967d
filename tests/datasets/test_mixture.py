"""Who controls which episodes: shares, members, inner loops and seeds."""

import pytest

from defmanip_gym.datasets.config import DatasetConfig
from defmanip_gym.datasets.mixture import common_inner_loop, parts_of
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.contestants import standard_contestants
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.evaluation.seeds import (
    FIRST_DATASET_SEED,
    FIRST_REFERENCE_SEED,
    LARGEST_DATASET_SEED,
    MOST_DATASET_EPISODES,
    dataset_seed,
)
from defmanip_gym.evaluation.suites import SUITES

NAME = "deform-transport/some-v0"


def contestants(*names, members=None):
    made = {c.name: c for c in standard_contestants(names, Certificates(), members)}
    return [made[name] for name in names]


@pytest.mark.parametrize(
    ("shares", "counts"), [((1, 1), [4, 3]), ((3, 1), [5, 2]), ((0.1, 0.9), [1, 6])]
)
def test_shares_are_kept_as_well_as_whole_episodes_allow(shares, counts):
    parts = parts_of(contestants("zero", "random"), shares, 7, seed=0)
    assert [len(part.seeds) for part in parts] == counts


def test_members_get_their_contestants_episodes_in_turn():
    parts = parts_of(contestants("random", "sac", members=2), (1, 3), 8, seed=2)
    assert [(part.contestant.name, part.member.name) for part in parts] == [
        ("random", "-"),
        ("sac", "0"),
        ("sac", "1"),
    ]
    first = dataset_seed(2)
    assert [part.seeds for part in parts[1:]] == [
        (first + 2, first + 4, first + 6),
        (first + 3, first + 5, first + 7),
    ]


def test_nobody_is_left_without_episodes():
    with pytest.raises(ParameterError, match="members of sac"):
        parts_of(contestants("random", "sac", members=3), (3, 1), 8, seed=0)


def test_a_dataset_has_one_inner_loop_and_references_go_with_it():
    assert common_inner_loop(contestants("random", "field")) == "measured_force"
    assert common_inner_loop(contestants("field", "sac@measured_force")) == "measured_force"
    assert common_inner_loop(contestants("random", "zero")) == "model"
    with pytest.raises(ParameterError, match="sac@measured_force"):
        common_inner_loop(contestants("field", "sac"))


def test_seeds_are_apart_from_suites_references_random_policies_and_other_datasets():
    largest = max(scenario.seed for suite in SUITES for scenario in suite.scenarios)
    assert largest < FIRST_REFERENCE_SEED < FIRST_DATASET_SEED == dataset_seed(0)
    assert dataset_seed(0, MOST_DATASET_EPISODES - 1) < dataset_seed(1)
    assert dataset_seed(LARGEST_DATASET_SEED, MOST_DATASET_EPISODES) < 1_000_000_000


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "--check"),
        ({"name": NAME, "check": NAME, "contestants": ("field",)}, "--check"),
        ({"name": NAME}, "contestants"),
        ({"name": "no-version", "contestants": ("field",)}, "-v"),
        ({"name": "../escape-v0", "contestants": ("field",)}, "dataset id"),
        ({"name": NAME, "contestants": ("field", "field")}, "once"),
        ({"name": NAME, "contestants": ("field",), "shares": (1.0, 2.0)}, "shares"),
        ({"name": NAME, "contestants": ("field",), "shares": (0.0,)}, "shares"),
        ({"name": NAME, "contestants": ("field",), "env": "CartPole-v1"}, "env"),
        ({"name": NAME, "contestants": ("field",), "episodes": 0}, "episodes"),
        ({"name": NAME, "contestants": ("field",), "seed": 10**6}, "seed"),
    ],
)
def test_settings_that_make_no_dataset_are_refused(settings, said):
    with pytest.raises(ParameterError, match=said):
        DatasetConfig(**settings)
