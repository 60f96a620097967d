"""docs/robustness.md: its script runs, and its controller has the limits that it tells."""

import re
from pathlib import Path

from defmanip_gym.baselines.analytic.field import FieldController, FieldParams
from defmanip_gym.params import BeamParams

PAGE = (Path(__file__).parents[1] / "docs" / "robustness.md").read_text()


def test_the_script_arrives_with_twice_the_mass(capsys):
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    exec(compile(script, "robustness.md", "exec"), {})
    assert capsys.readouterr().out.splitlines()[-1] == "True"


def test_the_elbow_holds_as_much_as_the_page_says():
    robot = FieldController().robot
    forearm = robot.forearm
    own = forearm.mass_kg * 9.81 * forearm.length_m / 2
    held_kg = (robot.elbow_torque_limit_nm - own) / (9.81 * forearm.length_m)
    assert f"hold {held_kg:.0f} kg at the goal, {held_kg / BeamParams().mass_kg:.1f} times" in PAGE


def test_the_gains_of_the_derivation_are_the_defaults():
    derivations = (Path(__file__).parents[1] / "docs" / "derivations.md").read_text()
    own = FieldParams()
    slope = own.way.approach_rate_per_s
    told = f"L = {own.observer_gain_per_s:g}, ε = {own.tracking_gain:g}, slope {slope:g}"
    assert f"{told}, κ = {own.following_rate:g}" in derivations
