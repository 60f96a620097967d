"""docs/filters.md says what the filters are and do."""

import re
from pathlib import Path

import gymnasium
import pytest

from defmanip_gym.theory.filters.family import FILTERS
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterWrapper

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "filters.md").read_text()
SCRIPT, OBJECTS = re.findall(r"```python\n(.*?)```", PAGE, re.S)


def test_the_script_keeps_sigma_against_what_feeds_the_swing(capsys):
    exec(compile(SCRIPT, "filters.md", "exec"), {})
    assert capsys.readouterr().out == "True True True\n" and "`True True True`" in PAGE


def test_without_the_filter_the_same_commands_exceed_sigma_as_soon_as_told(capsys):
    assert "exceeds σ within two seconds" in PAGE
    bare = re.sub(r"^env = SafetyFilterWrapper.*\n", "", SCRIPT, flags=re.M)
    bare = re.sub(r"^print.*", "print(worst)", bare, flags=re.M)
    bare = bare.replace("max_episode_steps=500", "max_episode_steps=100")  # two seconds
    exec(compile(bare, "filters.md", "exec"), {})
    assert float(capsys.readouterr().out) < 0


def test_the_script_for_objects_keeps_sigma_of_the_hose_and_without_filter_not(capsys):
    unfiltered = OBJECTS.replace("robot.step(decision.allowed_m_s2", "robot.step(wished")
    for script in (OBJECTS, unfiltered):
        exec(compile(script, "filters.md", "exec"), {})
    assert capsys.readouterr().out == "True\nFalse\n" and "It prints `True`" in PAGE


def test_every_member_of_the_family_has_its_row():
    assert set(re.findall(r"^\| `(\w+)` \| ", PAGE.split("## The family")[1], re.M)) >= set(FILTERS)


def test_every_key_that_the_wrapper_adds_is_told_and_no_other():
    env = SafetyFilterWrapper(gymnasium.make("defmanip_gym:DeformTransport-v0"), StorageFilter())
    added = set(env.reset(seed=0)[1]) - set(env.unwrapped.reset(seed=0)[1])
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \| ", PAGE.split("## The family")[0], re.M)
    assert {key for row in rows for key in re.findall(r"\w+", row)} - {"info"} == added


def test_every_part_of_the_interface_is_told():
    for part in SafetyFilter.__abstractmethods__:
        assert re.search(rf"`(?:memory = safety_filter\.)?{part}\b", PAGE), part


def test_the_level_that_is_left_in_the_default_environment_is_as_told():
    told = float(re.search(r"`level_share` is what is left, ([\d.]+) of it", PAGE)[1])
    config = gymnasium.make("defmanip_gym:DeformTransport-v0").unwrapped.config
    assert filter_for(config).level_share == pytest.approx(told, abs=0.005)


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target
