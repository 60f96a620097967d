"""Who takes part: everybody under the same options, and every agent fits."""

from __future__ import annotations

import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from small_agents import small_agent

from defmanip_gym.baselines.controller import RandomController
from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.agents import load_agent, load_family, shipped_families
from defmanip_gym.baselines.registry import available_controllers, registered_controllers
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import AgentFileError, ParameterError
from defmanip_gym.evaluation import learned_contestants, protection
from defmanip_gym.evaluation.contestants import (
    known_names,
    standard_contestants,
    standard_names,
)
from defmanip_gym.evaluation.controllers import RandomPerEpisode
from defmanip_gym.evaluation.learned_contestants import agent_contestants
from defmanip_gym.evaluation.options import FILTER_OPTION
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.filters.storage_filter import StorageFilter

SIZE = ObservationLayout(1).size


@pytest.fixture(scope="module")
def everyone():
    return standard_contestants(standard_names(), Certificates())


def agent(card_changes=(), size=SIZE):
    shipped = load_agent("ppo")
    widen = size - shipped.observation_size
    weights = [np.pad(shipped._weights[0], ((0, 0), (0, widen))), *shipped._weights[1:]]
    return MlpActor(
        replace(shipped.card, observation_size=size, **dict(card_changes)),
        weights=weights,
        biases=shipped._biases,
        observation_mean=np.pad(shipped._mean, (0, widen)),
        observation_variance=np.pad(shipped._variance, (0, widen)),
    )


def test_every_controller_gets_the_same_filter(everyone):
    names = [contestant.name for contestant in everyone]
    for controller in (*available_controllers(), *shipped_families()):
        assert controller in names and f"{controller}/{FILTER_OPTION}" in names
    assert {"zero", "random", "tanner/phase_plane", "tanner/l1", "tanner/tanner"} < set(names)


def test_whoever_learned_inside_a_certificate_is_shown_inside_it(everyone):
    assert "residual/phase_plane" in [contestant.name for contestant in everyone]


def test_every_controller_can_be_asked_for_inside_every_filter():
    names = known_names()
    for controller in (*registered_controllers(), *shipped_families()):
        for method in ("storage", "phase_plane", "l1", "tanner"):
            assert f"{controller}/{method}" in names


def test_names_tell_the_filter_and_families_the_kind(everyone):
    for contestant in everyone:
        _, _, method = contestant.name.partition("/")
        enforced = contestant.protection
        assert (enforced.method if enforced else "") == method
        base = contestant.name.partition("/")[0]
        kinds = dict.fromkeys(registered_controllers(), "analytic")
        kinds |= {"zero": "reference", "random": "reference"}
        assert contestant.family == kinds.get(base, "learned")
        assert contestant.privileged and contestant.description
    assert len({contestant.colour for contestant in everyone}) == len(everyone)


def test_certificates_are_for_the_beam_that_everybody_believes(everyone):
    for contestant in everyone:
        if contestant.certificate is not None:
            damping = 1.0 if contestant.certificate.method == "tanner" else 0.1
            assert contestant.certificate.deformable.damping == damping


def test_what_a_training_saw_is_its_environment(everyone):
    for contestant in everyone:
        if contestant.family == "learned":
            family = contestant.name.partition("/")[0]
            env_id = load_family(family)[0].card.env_id
            assert f"the plant of {env_id}" in contestant.privileged


def test_a_learned_contestant_has_a_member_for_each_seed(everyone):
    by_name = {contestant.name: contestant for contestant in everyone}
    for family in shipped_families():
        seeds = [str(actor.card.seed) for actor in load_family(family)]
        for name in (family, f"{family}/{FILTER_OPTION}"):
            assert [member.name for member in by_name[name].members] == seeds
        (limited,) = standard_contestants([family], Certificates(), member_limit=1)
        assert [member.name for member in limited.members] == seeds[:1]
    assert [member.name for member in by_name["tanner"].members] == ["-"]


def test_whatever_a_job_needs_can_be_pickled(everyone):
    env = gymnasium.make_vec(ENV_ID, num_envs=2)
    observation, _ = env.reset(options={"start": "paper"})  # from where plans are stored
    env.close()
    for contestant in everyone:
        again = pickle.loads(pickle.dumps(contestant))
        actions, copied = (
            each.members[0].controller.build([1, 2]).predict(observation)[0]
            for each in (contestant, again)
        )
        np.testing.assert_array_equal(actions, copied)
        assert again.members[0].controller.identity == contestant.members[0].controller.identity


def test_only_certificates_that_are_needed_are_computed(monkeypatch):
    def fail(*arguments, **options):
        raise AssertionError("computed a certificate")

    monkeypatch.setattr(protection, "certify", fail)
    standard_contestants(["zero", "random", "tanner"], Certificates())
    with pytest.raises(AssertionError):
        standard_contestants(["tanner/l1"], Certificates())


def test_a_typo_gets_the_names():
    with pytest.raises(ParameterError, match="'tanner/l1'"):
        standard_contestants(["tanner/l2"], Certificates())


def test_random_actions_belong_to_the_episode():
    both = RandomPerEpisode([5, 6]).predict(np.zeros((2, SIZE)))[0]
    alone = RandomPerEpisode([6]).predict(np.zeros((1, SIZE)))[0]
    np.testing.assert_array_equal(both[1], alone[0])
    # not the numbers that sampled the start of the same seed
    assert not np.array_equal(alone[0], RandomController(6).predict(np.zeros(SIZE))[0])


def test_agents_of_one_folder_name_stay_apart(tmp_path):
    folders = [tmp_path / parent / "run" for parent in ("a", "b")]
    for seed, folder in enumerate(folders):
        agent({"seed": seed}).save(folder / "agent")
    pairs = [agent_contestants(folder, Certificates()) for folder in folders]
    assert len({contestant.name for pair in pairs for contestant in pair}) == 4
    plain, certified = pairs[0]
    assert certified.name == f"{plain.name}/{FILTER_OPTION}"
    assert plain.protection is None and certified.protection is not None


def test_an_agent_is_also_shown_inside_what_it_learned_in(tmp_path):
    specification = StorageFilter().specification | {"name": "backup"}
    changes = {"safety_filter": "backup", "filter_specification": specification}
    agent(changes).save(tmp_path / "agent")
    shown = agent_contestants(tmp_path, Certificates())
    options = [contestant.name.partition("/")[2] for contestant in shown]
    assert options == ["", FILTER_OPTION, "backup"]
    assert len({contestant.colour for contestant in shown}) == 3


def test_an_agent_for_other_observations_is_refused(tmp_path):
    agent(size=SIZE + 2).save(tmp_path / "agent")
    with pytest.raises(AgentFileError, match=rf"{SIZE + 2}.*{SIZE}"):
        agent_contestants(tmp_path, Certificates())


def test_what_an_agent_corrects_inside_a_filter_is_the_same_inside_a_certificate(monkeypatch):
    specification = StorageFilter().specification
    card = {"safety_filter": "storage", "filter_specification": specification}
    corrects = small_agent(**card, residual_authority_m_s2=1.0, residual_base="oriented")
    monkeypatch.setattr(learned_contestants, "load_family", lambda name: (corrects,))
    for name in ("mine", "mine/storage", "mine/l1"):
        (member,) = learned_contestants.family_contestant(name, Certificates(), None).members
        assert member.controller.identity["base"]["controller"] == "oriented"
