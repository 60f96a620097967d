"""Scores in cards are those of the agents' own records, and can be measured again."""

import shlex
import shutil
from dataclasses import replace

import pytest
import tyro
from episodes import record

from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.baselines.learned.card import SuiteScore
from defmanip_gym.baselines.learned.families import SHIPPED
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.agent_scores import (
    contestant_name,
    scoring_commands,
    suite_score,
    write_scores,
)
from defmanip_gym.evaluation.comparison import run_comparison
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.controllers import Learned
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.jobs import job_fingerprint
from defmanip_gym.evaluation.store import RecordFolder
from defmanip_gym.evaluation.suites import suite_named

NOMINAL = suite_named("nominal")
ENTRY = Entry(suite="nominal", contestant="ppo", family="learned", member="0")
SCORE = SuiteScore(
    success_rate=1.0, violation_rate=0.0, score_iqm=0.5, median_time_s=9.0, episodes=1
)


@pytest.fixture
def library(tmp_path):
    """A family of one agent without scores."""
    folder = tmp_path / "library" / "ppo"
    folder.mkdir(parents=True)
    for suffix in (".json", ".safetensors"):
        shutil.copy(SHIPPED / "ppo" / f"seed-0{suffix}", folder)
    return folder.parent


def own(**changes):
    defaults = dict(suite="nominal", contestant="ppo", member="0", family="learned")
    return record(**(defaults | changes))


def write(folder, records, actor):
    identity = job_fingerprint(NOMINAL, Learned(actor), None)
    RecordFolder(folder / "records").write(ENTRY, identity, records)


def test_scores_are_counted_from_records():
    score = suite_score(
        [
            own(start_distance_m=10.0, time_to_goal_s=10.0),  # 0.5 of the speed limit of 2 m/s
            own(start_distance_m=10.0, time_to_goal_s=12.5),  # 0.4
            own(start_distance_m=10.0, time_to_goal_s=20.0),  # 0.25
            own(outcome="violation", success=False, violated=True, time_to_goal_s=9.0),  # 0
        ]
    )
    assert score.score_iqm == pytest.approx((0.4 + 0.25) / 2)
    assert (score.success_rate, score.violation_rate) == (0.75, 0.25)
    assert (score.median_time_s, score.episodes, score.successes) == (12.5, 4, 3)


def test_without_success_there_is_no_time():
    score = suite_score([own(outcome="timeout", success=False, time_to_goal_s=None)])
    assert score.median_time_s is None and score.score_iqm == 0.0


def test_scores_written_into_a_card_are_those_of_its_records(library, tmp_path):
    records = [own(scenario=f"s{i}", time_to_goal_s=10.0 + i) for i in range(5)]
    write(tmp_path, records, load_agent("ppo", library))
    assert write_scores(tmp_path, library) == ("ppo/seed-0",)
    assert load_agent("ppo", library).card.scores == {"nominal": suite_score(records)}
    assert write_scores(tmp_path, library) == ("ppo/seed-0",)  # they change no fingerprint


def test_an_agents_listed_scores_are_found_again(library, tmp_path):
    found = []
    for name in ("first", "second"):
        run_comparison(
            ComparisonConfig(
                suites=("nominal",),
                episodes=2,
                contestants=("ppo",),
                members=1,
                output=tmp_path / name,
                jobs=1,
            )
        )
        write_scores(tmp_path / name, library)
        found.append(load_agent("ppo", library).card.scores["nominal"])
    assert found[0] == found[1]
    assert found[0].episodes == 2


def test_records_of_another_agent_or_none_change_no_card(library, tmp_path):
    actor = load_agent("ppo", library)
    with pytest.raises(RecordError, match="evaluate.py"):
        write_scores(tmp_path, library)
    actor.card = replace(actor.card, command="python train.py --algo ppo --seed 0 --other")
    write(tmp_path, [own()], actor)
    with pytest.raises(RecordError, match="another agent"):
        write_scores(tmp_path, library)
    assert load_agent("ppo", library).card.scores == load_agent("ppo").card.scores


@pytest.mark.parametrize(
    ("scores", "suites", "episodes"),
    [
        ({}, ("all",), "all"),
        ({"nominal": 64, "far": 48}, ("nominal", "far"), "all"),
        ({"nominal": 24, "paper": 2}, ("nominal", "paper"), 24),
        ({"mismatch": 16}, ("mismatch",), 2),
    ],
)
def test_the_command_that_measures_again_covers_what_the_card_lists(scores, suites, episodes):
    listed = {suite: replace(SCORE, episodes=count) for suite, count in scores.items()}
    card = replace(load_agent("ppo").card, scores=listed)
    evaluation, writing = scoring_commands("ppo/seed-0", card)
    config = tyro.cli(ComparisonConfig, args=shlex.split(evaluation)[2:])
    assert (config.suites, config.episodes) == (suites, episodes)
    assert config.contestants == ("ppo",) and config.member_limit is None
    assert writing == f"defmanip agents --score {config.output}"


def test_agents_trained_under_a_certificate_are_scored_under_it():
    card = replace(load_agent("ppo").card, certificate="phase_plane")
    assert contestant_name("residual", card) == "residual/phase_plane"
    assert "residual" not in scoring_commands("runs/mine", card)[0]
    assert "--agents runs/mine" in scoring_commands("runs/mine", card)[0]
