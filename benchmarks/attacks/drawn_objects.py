"""Objects for attacks: the examples, and chains drawn at random, as MuJoCo model files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

Rng = np.random.Generator

HOSE = files("defmanip_gym.objects") / "examples" / "hose.xml"
GRASP = '<site name="grasp"/>'
# a rod on a universal joint; a bucket on a tray that slides; an arm whose mass is off its axis
EXAMPLES = {
    "universal": """<body>{grasp}<body><joint name="pitch" axis="0 -1 0"/>
        <inertial pos="0 0 -0.001" mass="0.01" diaginertia="1e-5 1e-5 1e-5"/>
        <body><joint name="roll" axis="1 0 0"/>
        <inertial pos="0 0 -0.3" mass="2" diaginertia="0.06 0.06 0.001"/></body></body></body>""",
    "bucket": """<body>{grasp}<geom size="0.03" mass="0.3"/>
        <body><joint name="slide" type="slide" axis="1 0 0" stiffness="60"/>
        <geom type="box" size="0.1 0.1 0.01" mass="0.4"/>
        <body pos="0 0 -0.05"><joint name="pitch" axis="0 -1 0"/><joint name="roll" axis="1 0 0"/>
        <geom type="cylinder" size="0.08 0.1" pos="0 0 -0.25" mass="1.2"/></body></body></body>""",
    "bent": """<body>{grasp}<body><joint name="upper" axis="0 -1 0" stiffness="4"/>
        <inertial pos="0.05 0.02 -0.2" mass="1" diaginertia="0.02 0.02 0.001"/>
        <body pos="0 0 -0.4"><joint name="lower" axis="0.6 -0.8 0" stiffness="2" armature="0.01"/>
        <inertial pos="0.04 0 -0.2" mass="0.7" diaginertia="0.02 0.02 0.001"/>
        </body></body></body>""",
}


def object_file(folder: Path, seed: int) -> tuple[Path, str]:
    """Return a model file, written into a folder, and what it is."""
    rng, names = np.random.default_rng(seed), ("hose", *EXAMPLES, *("drawn",) * 4)
    name = names[seed % len(names)]
    if name == "hose":
        return Path(str(HOSE)), name
    body = EXAMPLES[name].format(grasp=GRASP) if name in EXAMPLES else _chain(rng)
    path = folder / f"{name}-{seed}.xml"
    path.write_text(f"<mujoco><compiler angle='radian'/><worldbody>{body}</worldbody></mujoco>")
    return path, name


def _chain(rng: Rng) -> str:
    """Return bodies below one another, now and then beside one another, on one joint or two."""
    count = int(rng.choice([1, 2, 3, 4, 6]))
    mass, length = float(rng.uniform(0.5, 4.0)) / count, float(rng.uniform(0.3, 0.9)) / count
    sprung, damped = rng.random() < 0.6, rng.random() < 0.5
    text = ""
    for index in reversed(range(count)):
        joints, left = "", rng.choice([1, 2]) if count < 4 else 1
        for k in range(left):
            joints += _joint(rng, f"{index}_{k}", sprung or index > 0, damped)
        across, along = mass * length**2 / 12 + 1e-5, mass * 0.02**2 / 2 + 1e-5
        aside = rng.uniform(-0.02, 0.02, 2) if rng.random() < 0.3 else (0.0, 0.0)
        inner = f"</body>{text}" if index and rng.random() < 0.15 else f"{text}</body>"
        text = (
            f'<body pos="0 0 {-length if index else 0}">{joints}'
            f'<inertial pos="{aside[0]} {aside[1]} {-length / 2}" mass="{mass}"'
            f' diaginertia="{across} {across} {along}"/>{inner}'
        )
    return f"<body>{GRASP}{text}</body>"


def _joint(rng: Rng, name: str, sprung: bool, damped: bool) -> str:
    damping = float(rng.uniform(0.01, 0.2)) if damped else 0.0
    stiffness = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0)))) if sprung else 0.0
    if rng.random() < 0.1:
        stiffness = float(rng.uniform(100.0, 400.0))
        return (
            f'<joint name="j{name}" type="slide" axis="{rng.choice((0, 1))} 0.5 1"'
            f' stiffness="{stiffness}" damping="{damping}"/>'
        )
    course = rng.choice([0.0, np.pi / 2, rng.uniform(0, np.pi)])
    return (
        f'<joint name="j{name}" axis="{np.sin(course)} {-np.cos(course)} 0"'
        f' stiffness="{stiffness}" damping="{damping}"/>'
    )
