"""The package's structure: what importing costs and which way imports point."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import defmanip_gym

PACKAGE = Path(defmanip_gym.__file__).parent

# lower layers first; a module imports from its own layer or below
LAYERS = [
    {"errors", "version", "files", "display", "workers", "compiled", "compiler", "lowering"},
    {"validation", "state_tree"},
    {"params", "task_params", "observation", "disturbance_ranges"},
    {"theory", "plant"},
    {"objects", "planning"},
    {"attack", "payloads"},
    {"envs"},
    {"wrappers"},
    {"baselines"},
    {"evaluation"},
    {"reproduction", "certification", "catalogue", "oracle", "datasets"},
    {"training"},
    {"exports"},
    {"cli", "__main__"},
]
# siblings that must not know each other
STRANGERS = [
    ("theory", "plant"),
    ("plant", "theory"),
    ("baselines", "plant"),
    ("evaluation", "plant"),
]


def part_of(path):
    relative = path.relative_to(PACKAGE)
    return relative.parts[0].removesuffix(".py")


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def modules():
    return [
        path
        for path in PACKAGE.rglob("*.py")
        if path.name != "__init__.py" or path.parent != PACKAGE
    ]


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_downwards(path):
    level = {name: index for index, names in enumerate(LAYERS) for name in names}
    part = part_of(path)
    for module in imports(path):
        if not module.startswith("defmanip_gym."):
            continue
        other = module.split(".")[1]
        assert level[other] <= level[part], f"{part} imports {other}"
        assert (part, other) not in STRANGERS


def test_theory_and_controllers_do_not_know_mujoco():
    for path in modules():
        if part_of(path) in {"theory", "baselines", "wrappers", "evaluation"}:
            assert not any(name.split(".")[0] == "mujoco" for name in imports(path)), path


def test_importing_the_package_loads_neither_torch_nor_sb3():
    code = (
        "import sys, defmanip_gym; "
        "heavy = {'torch', 'stable_baselines3', 'mujoco', 'matplotlib'} & set(sys.modules); "
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_bare_id_works_after_importing_the_package():
    code = "import gymnasium, defmanip_gym; gymnasium.make('DeformTransport-v0').reset(seed=0)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_running_an_environment_and_the_papers_controller_needs_no_torch():
    code = (
        "import sys, gymnasium; "
        "from defmanip_gym.baselines.analytic.tanner import TannerController; "
        "env = gymnasium.make('defmanip_gym:DeformTransport-v0'); "
        "observation, _ = env.reset(seed=0); "
        "env.step(TannerController().predict(observation)[0]); "
        "sys.exit('torch' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_reading_order_of_the_theory_names_every_module():
    text = (PACKAGE / "theory" / "__init__.py").read_text()
    paths = (PACKAGE / "theory").rglob("*.py")
    modules = {p.parent.name if p.stem == "__init__" else p.stem for p in paths} - {"theory"}
    assert modules == set(re.findall(r"``(\w+)``", text))
