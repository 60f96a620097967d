"""What docs/recipes.md shows works."""

import re
from pathlib import Path

import gymnasium
import gymnasium.wrappers.vector as wrappers
import numpy as np
import pytest

RECIPES = (Path(__file__).parents[1] / "docs" / "recipes.md").read_text()
MODES = ("SameStep", "NextStep", "Disabled")
ARGUMENTS = {
    "TransformReward": (lambda reward: 2 * reward,),
    "ClipReward": (-1.0, 1.0),
    "RescaleAction": (-2.0, 2.0),
    "TransformAction": (lambda actions: 0.5 * actions,),
    "TransformObservation": (lambda observation: 2 * observation,),
    "DtypeObservation": (np.float32,),
}


def scripts():
    """Return (heading, script) for every Python block."""
    parts = re.split(r"^## (.+)$", RECIPES, flags=re.M)
    return [
        (heading, script)
        for heading, text in zip(parts[1::2], parts[2::2], strict=True)
        for script in re.findall(r"```python\n(.*?)```", text, re.S)
    ]


def make(mode):
    return gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0", num_envs=2, max_episode_steps=3, autoreset_mode=mode
    )


@pytest.mark.parametrize("heading, script", scripts())
def test_every_script_runs(heading, script, request):
    if "render_mode" in script:
        request.getfixturevalue("opengl")
    for module in ("torch", "stable_baselines3", "torchrl"):
        if re.search(rf"^(?:import|from) {module}\b", script, re.M):
            pytest.importorskip(module)
    exec(compile(script, f"recipes.md, {heading}", "exec"), {"__name__": "recipe"})


def test_both_loops_collect_the_transitions_of_the_same_episodes():
    same_step, next_step = ({}, {})
    loops = [script for heading, script in scripts() if heading == "A plain Gymnasium loop"]
    for names, script in zip((same_step, next_step), loops, strict=True):
        # all zeros: the two draw actions for different steps
        exec(script.replace("rng.uniform(-1.0, 1.0, ", "np.zeros("), names)
    for part in range(5):
        rows = [
            np.concatenate([step[part] for step in names["transitions"]])
            for names in (same_step, next_step)
        ]
        # the last episodes are two steps shorter where two steps went into starting
        assert len(rows[0]) == 8 * 120 and len(rows[1]) == 8 * 118
        assert np.array_equal(rows[0][: len(rows[1])], rows[1])


@pytest.mark.parametrize(
    "name, row", re.findall(r"^\| `(\w+)` ((?:\| (?:yes|no) ){3})\|$", RECIPES, re.M)
)
def test_wrappers_take_the_modes_that_the_table_says(name, row):
    for mode, answer in zip(MODES, re.findall("yes|no", row), strict=True):
        env = make(mode)
        if answer == "no":
            with pytest.raises(ValueError, match="autoreset_mode"):
                getattr(wrappers, name)(env, *ARGUMENTS.get(name, ()))
        else:
            env = getattr(wrappers, name)(env, *ARGUMENTS.get(name, ()))
            env.reset(seed=0)
            for _ in range(3 if mode == "Disabled" else 5):
                env.step(np.zeros((2, 3)))
        env.close()


@pytest.mark.parametrize("mode", MODES[:2])
def test_recorded_statistics_count_every_step_once(mode):
    env = wrappers.RecordEpisodeStatistics(make(mode))
    env.reset(seed=0)
    for _ in range(9):
        env.step(np.zeros((2, 3)))
    assert set(env.length_queue) == {3}
