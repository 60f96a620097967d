"""docs/controllers.md: its script arrives, and it tells of every controller of the ladder."""

import re
from pathlib import Path

import pytest

from defmanip_gym.baselines.analytic import field
from defmanip_gym.baselines.analytic.mpc import MpcParams
from defmanip_gym.baselines.analytic.way_params import WayParams

PAGE = (Path(__file__).parents[1] / "docs" / "controllers.md").read_text()


def test_the_script_arrives(capsys):
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    exec(compile(script, "controllers.md", "exec"), {})
    assert capsys.readouterr().out.splitlines()[-1] == "True"


@pytest.mark.parametrize("name", ["lqr", "shaped", "mpc"])
def test_each_has_its_section_and_its_row(name):
    assert f"\n## {name}\n" in PAGE and f"| `{name}` |" in PAGE


def test_the_numbers_in_words_are_the_defaults():
    assert f"|φ| ≤ {MpcParams().sigma_share:g} σ" in PAGE
    assert f"beyond {MpcParams().heading_share:g} of its tolerance" in PAGE
    assert f"within {WayParams().settling_radius_m:g} m of the goal" in PAGE


@pytest.mark.parametrize("name", ["tanner", "field", "lqr", "shaped", "mpc", "time_optimal"])
def test_each_law_is_one_file_that_is_read_in_one_go(name):
    file = Path(field.__file__).with_name(f"{name}.py")
    assert len(file.read_text().splitlines()) <= 150
