"""Agents come back from disk as they were, and what is no agent is refused by name."""

import json
from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file
from small_agents import CARD, small_agent

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.baselines.learned.agents import load_agent, load_controller, load_family
from defmanip_gym.baselines.learned.card import Normalization, SuiteScore
from defmanip_gym.baselines.learned.deployment import controller_of
from defmanip_gym.baselines.learned.families import shipped_families, write_card
from defmanip_gym.errors import AgentFileError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.theory.filters.storage_filter import StorageFilter

SCORE = SuiteScore(
    success_rate=0.75, violation_rate=0.25, score_iqm=0.5, median_time_s=9.0, episodes=8
)


@pytest.fixture
def library(tmp_path):
    for seed in (10, 2):
        small_agent(seed=seed).save(tmp_path / "ppo" / f"seed-{seed}")
    (tmp_path / "empty").mkdir()
    return tmp_path


@pytest.fixture
def stem(tmp_path):
    stem = tmp_path / "run-1.5" / "agent"
    small_agent(scores={"nominal": SCORE}).save(stem)
    return stem


def test_an_agent_comes_back_as_it_was_saved(stem):
    saved, observation = small_agent(scores={"nominal": SCORE}), np.linspace(-3, 3, 22)
    for path in (stem.parent, f"{stem}.safetensors", f"{stem}.json"):
        loaded = load_agent(path)
        assert loaded.card == saved.card
        assert loaded.predict(observation)[0] == pytest.approx(
            saved.predict(observation)[0], abs=1e-5
        )


def test_a_name_with_dots_is_kept_whole(tmp_path):
    small_agent().save(tmp_path / "agent-1.5")
    assert load_agent(tmp_path / "agent-1.5.safetensors").card == CARD


def test_the_cards_normalization_is_applied():
    narrow = small_agent(normalization=Normalization(clip=0.01))
    inside, outside = np.full(22, 0.01), np.linspace(0.01, 5.0, 22)
    assert narrow.predict(outside)[0] == pytest.approx(small_agent().predict(inside)[0], abs=1e-6)


def test_an_agents_digest_does_not_depend_on_its_scores():
    assert small_agent(scores={"nominal": SCORE}).digest == small_agent().digest
    assert small_agent(seed=1).digest != small_agent().digest


def test_a_family_is_sorted_by_seed_and_its_name_alone_means_the_lowest(library):
    assert shipped_families(library) == ("ppo",)
    assert [member.card.seed for member in load_family("ppo", library)] == [2, 10]
    assert load_agent("ppo", library).card.seed == 2
    assert load_agent("ppo/seed-10", library).card.seed == 10


def test_writing_a_card_leaves_the_tensors(library):
    before = load_agent("ppo/seed-2", library)
    write_card("ppo", replace(before.card, scores={"far": SCORE}), library)
    after = load_agent("ppo/seed-2", library)
    assert after.card.scores == {"far": SCORE}
    assert after.digest == before.digest


@pytest.mark.parametrize(
    ("name", "said"),
    [("ppo/seed-3", "seed-10"), ("ppo/../ppo/seed-2", "seed-2"), ("empty", "ppo"), ("sac", "ppo")],
)
def test_unknown_names_are_answered_with_those_there_are(name, said, library):
    with pytest.raises(AgentFileError, match=said):
        load_agent(name, library)


def test_families_without_members_or_with_strangers_are_refused(library):
    for name in ("empty", "sac"):
        with pytest.raises(AgentFileError, match="ppo"):
            load_family(name, library)
    small_agent(seed=3, recipe="residual").save(library / "ppo" / "seed-3")
    with pytest.raises(AgentFileError, match="recipe"):
        load_family("ppo", library)
    small_agent(seed=4).save(library / "ppo" / "seed-3")
    with pytest.raises(AgentFileError, match="file's name"):
        load_family("ppo", library)


@pytest.mark.parametrize(
    "changes",
    [
        {"env_id": "CartPole-v1"},
        {"observation_size": 0},
        {"observation_size": "22"},
        {"observation_size": 21},
        {"action_size": 4},
        {"action_size": True},
        {"activation": ["tanh"]},
        {"algorithm": "dqn"},
        {"seed": -1},
        {"squashed": 1},
        {"hyperparameters": []},
        {"certificate": "none"},
        {"safety_filter": "nu_max"},
        {"safety_filter": "storage", "certificate": "l1"},
        {"filter_specification": {"name": "storage"}},
        {"safety_filter": "backup", "filter_specification": {"name": "storage"}},
        {"residual_authority_m_s2": 1.0},
        {"residual_authority_m_s2": float("nan"), "certificate": "l1"},
        {"normalization": {"clip": 0}},
        {"normalization": {"mean": 0}},
        {"normalization": None},
        {"scores": {"nominal": {"success_rate": 1.0}}},
        {"scores": []},
        {"scores": {"nominal": {**vars(SCORE), "success_rate": 1.5}}},
        {"colour": "red"},
    ],
    ids=json.dumps,
)
def test_cards_that_cannot_be_true_are_refused(changes, stem):
    path = stem.with_suffix(".json")
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    with pytest.raises(AgentFileError):
        load_agent(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "JSON"),
        ("[" * 100_000, "JSON"),
        ("\xff", "JSON"),
        ("[]", "format"),
        ("{}", "format"),
        ('{"format": 1}', "Train"),
        ('{"format": 4}', "Upgrade"),
        (" " * 2_000_000, "bytes"),
    ],
    ids=["empty", "deep", "binary", "list", "no format", "older", "newer", "huge"],
)
def test_files_that_are_no_cards_are_refused(text, said, stem):
    stem.with_suffix(".json").write_text(text, encoding="latin-1")
    with pytest.raises(AgentFileError, match=said):
        load_agent(stem.parent)


@pytest.mark.parametrize(
    "changes",
    [
        {"layers.0.weight": np.full((8, 22), np.nan, np.float32)},
        {"layers.0.weight": np.full((8, 22), 1e30, np.float32)},
        {"layers.0.weight": np.zeros((8, 21), np.float32)},
        {"layers.0.weight": np.zeros((8, 22, 1), np.float32)},
        {"layers.0.bias": np.zeros((), np.float32)},
        {"layers.0.bias": np.zeros(8, np.complex64)},
        {"observation.variance": -np.ones(22)},
        {"observation.mean": np.full(22, np.inf)},
        {"observation.mean": None},
        {"layers.1.weight": None, "layers.1.bias": None},
        {"layers.0.weight": None},
        {"layers.7.weight": np.zeros((3, 3), np.float32)},
        {"surprise": np.zeros(3)},
    ],
    ids=lambda changes: ", ".join(changes),
)
def test_tensors_that_cannot_be_an_agents_are_refused(changes, stem):
    path = stem.with_suffix(".safetensors")
    tensors = load_file(path) | changes
    save_file({name: value for name, value in tensors.items() if value is not None}, path)
    with pytest.raises(AgentFileError, match="agent"):
        load_agent(path)


def test_missing_cut_and_misplaced_files_are_refused(stem, tmp_path):
    tensors = stem.with_suffix(".safetensors")
    content = tensors.read_bytes()
    for damage in (b"", content[:100], content[:-1], content + b"x", b"nonsense" * 100):
        tensors.write_bytes(damage)
        with pytest.raises(AgentFileError, match="damaged"):
            load_agent(tensors)
    tensors.unlink()
    with pytest.raises(AgentFileError, match="existing"):
        load_agent(tensors)
    tensors.mkdir()
    with pytest.raises(AgentFileError, match="folder"):
        load_agent(stem.with_suffix(".json"))
    for nothing in (tmp_path, tmp_path / "none.json", "none", "", "a\0.json", "x" * 999):
        with pytest.raises(AgentFileError):
            load_agent(nothing)


def test_observations_of_another_beam_are_refused():
    with pytest.raises(AgentFileError, match="segments"):
        small_agent().predict(np.zeros((4, 24)))


def test_a_residual_agent_corrects_the_papers_controller():
    certificate = certify(BeamParams(), method="l1", conditions=TRANSPORT_CONDITIONS)
    agent = small_agent(certificate="l1", residual_authority_m_s2=0.3)
    observation = np.random.default_rng(0).normal(size=(4, 22))
    base, state = TannerController(certificate=certificate, params=GENTLE_PARAMS).predict(
        observation
    )
    expected = np.clip(base + 0.3 / 3.0 * agent.predict(observation)[0], -1.0, 1.0)
    action, next_state = controller_of(agent).predict(observation)
    assert action == pytest.approx(expected, abs=1e-12)
    below, *_ = next_state
    assert all(np.array_equal(a, b) for a, b in zip(below, state, strict=True))
    assert controller_of(small_agent()).predict(observation)[0] == pytest.approx(
        small_agent().predict(observation)[0]
    )


FILTER = StorageFilter().specification
CORRECTS = {"safety_filter": "storage", "residual_authority_m_s2": 1.0}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"safety_filter": "storage"}, "filter_specification"),
        (
            {
                "safety_filter": "storage",
                "filter_specification": FILTER | {"conditions": {"forward_error_m_s2": 1e3}},
            },
            "V_σ",
        ),
        (
            {
                "safety_filter": "storage",
                "filter_specification": StorageFilter(BeamParams(segment_count=3)).specification,
            },
            "22 observations",
        ),
        (CORRECTS | {"residual_base": "nobody"}, "residual_base"),
        (CORRECTS | {"hyperparameters": {"env_kwargs": {"beam": 3}}}, "env_kwargs"),
        (CORRECTS | {"residual_authority_m_s2": 4.0}, "authority"),
        (CORRECTS | {"residual_decision_periods": 5000}, "decision_periods"),
        ({"certificate": "l1", "residual_authority_m_s2": 1.0, "residual_base": "lqr"}, "tanner"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_agents_that_cannot_run_as_they_were_trained_are_refused(changes, said, stem):
    small_agent(**changes).save(stem)
    with pytest.raises(AgentFileError, match=said):
        load_controller(stem.with_name("agent.json"))
