"""Build sdist and wheel, and run the installed wheel with every Python that is supported.

``python .ci/check_wheel.py [python ...]`` builds the sdist from what git tracks and the wheel from
the sdist, into ``dist/``, looks for the whole package in it, and installs it into an empty
environment of each Python named, by default of each one found. There it runs from outside of the
checkout: first as the user who installed it, then as one who can write to no folder of the package
and has no home. Exit status: 0 where all of this works, 1 otherwise.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from pythons import ROOT, Python, pythons

PACKAGE = "defmanip_gym"
LIMIT_S = 600.0
NOBODY = 65534
# Reading everything, since an interpreter may lie in root's home, and writing nothing
AS_NOBODY = (
    f"setpriv --reuid={NOBODY} --regid={NOBODY} --clear-groups"
    " --inh-caps=+dac_read_search --ambient-caps=+dac_read_search"
)

EPISODE = """
import sys
from pathlib import Path
import gymnasium
import defmanip_gym
from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.baselines.analytic.tanner import TannerController

assert Path(defmanip_gym.__file__).is_relative_to(sys.prefix), defmanip_gym.__file__
controller, state, ended = {controller}, None, False
env = gymnasium.make("defmanip_gym:DeformTransport-v0", max_episode_steps=3000)
observation, info = env.reset(seed=0)
while not ended:
    action, state = controller.predict(observation, state)
    observation, reward, terminated, truncated, info = env.step(action)
    ended = terminated or truncated
assert info["is_success"], info
"""
PAPERS_EPISODE = EPISODE.format(controller="TannerController()")
AGENTS_EPISODE = EPISODE.format(controller='load_agent("sac")')
BATCH = """
import gymnasium, numpy as np

env = gymnasium.make_vec("defmanip_gym:DeformTransport-v0", num_envs=4, max_episode_steps=20)
env.reset(seed=0)
ends = 0
for _ in range(50):
    observation, _, terminated, truncated, _ = env.step(np.zeros((4, 3)))
    ends += int(np.sum(terminated | truncated))
assert ends == 8 and np.isfinite(observation).all(), (ends, observation)
"""


class Failure(Exception):
    """Something does not work; the text says what was seen."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """An installed wheel, and the folder that it is run in."""

    programs: Path
    folder: Path
    before: list[str] = field(default_factory=list)
    settings: dict[str, str] = field(default_factory=dict)

    def run(self, program: str, *words: str) -> str:
        """Return what a program says beside its output; raise Failure where it fails."""
        kept = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("PYTHON", "NUMBA_", "XDG_"))
        }
        answer = subprocess.run(
            [*self.before, self.programs / program, *words],
            cwd=self.folder,
            env=kept | self.settings,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
        if answer.returncode:
            said = (answer.stderr or answer.stdout).strip()
            raise Failure(f"{program} ended with {answer.returncode}:\n{said}")
        return answer.stderr


def papers_episode(place: Place) -> None:
    """Run the paper's controller to the goal."""
    place.run("python", "-c", PAPERS_EPISODE)


def batch(place: Place) -> None:
    """Run episodes at once."""
    place.run("python", "-c", BATCH)


def agents_episode(place: Place) -> None:
    """Run a shipped agent to the goal."""
    place.run("python", "-c", AGENTS_EPISODE)


def agents(place: Place) -> None:
    """List the shipped agents."""
    place.run("defmanip", "agents")


def certify(place: Place) -> None:
    """Compute and attack certificates."""
    place.run("defmanip", "certify", "--longest-attack-s", "5", "--output", "certificates")


def not_writable(place: Place) -> None:
    """Run all of it where no machine code can be kept, and keep it where the message says."""
    code = place.folder / "machine code"
    said = place.run("python", "-c", PAPERS_EPISODE)
    if said.count("NUMBA_CACHE_DIR") != 1:
        raise Failure(f"what to set to keep the machine code is not told once, but:\n{said}")
    kept = Place(
        programs=place.programs,
        folder=place.folder,
        before=place.before,
        settings=place.settings | {"NUMBA_CACHE_DIR": str(code)},
    )
    for check in (papers_episode, batch, agents_episode, agents, certify):
        check(kept)
    if "compiling" in (said := kept.run("python", "-c", PAPERS_EPISODE)):
        raise Failure(f"NUMBA_CACHE_DIR was set, but the machine code is not kept:\n{said}")


CHECKS: dict[str, Callable[[Place], None]] = {
    "episode": papers_episode,
    "batch": batch,
    "agent": agents_episode,
    "agents": agents,
    "certify": certify,
}


def tracked() -> list[str]:
    """Return the names of the files that git tracks."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [name for name in listed.stdout.split("\0") if (ROOT / name).is_file()]


def built(python: Python, folder: Path) -> Path:
    """Build the sdist from what git tracks, and the wheel from it; return the wheel."""
    source, programs = folder / "source", python.environment(folder / "building", "build")
    # setuptools packs what an earlier build has listed in *.egg-info; a fresh clone has none
    for name in tracked():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    answer = subprocess.run(
        [programs / "python", "-m", "build", "--outdir", ROOT / "dist", source],
        capture_output=True,
        text=True,
        check=False,
    )
    if answer.returncode:
        sys.exit(f"sdist and wheel cannot be built:\n{answer.stdout}{answer.stderr}")
    (wheel,) = (ROOT / "dist").glob("*.whl")
    return wheel


def check_content(wheel: Path) -> None:
    """End the program unless the wheel holds the whole package and the licence."""
    names = zipfile.ZipFile(wheel).namelist()
    wanted = {name for name in tracked() if name.startswith(f"{PACKAGE}/")}
    if missing := sorted(wanted - set(names)):
        sys.exit(f"The wheel lacks: {', '.join(missing)}.")
    if not any(name.endswith(".dist-info/licenses/LICENSE") for name in names):
        sys.exit("The wheel lacks the licence.")


def unprivileged(programs: Path, folder: Path) -> Place:
    """Return a place whose user may write to its own folder alone and has no home."""
    folder.mkdir()
    before = []
    if os.getuid() == 0:
        before = AS_NOBODY.split()
        os.chown(folder, NOBODY, NOBODY)
    (package,) = programs.parent.glob(f"lib/*/site-packages/{PACKAGE}")
    for path in (package, *package.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    settings = {"HOME": "/nonexistent", "TMPDIR": str(folder)}
    return Place(programs=programs, folder=folder, before=before, settings=settings)


def outcomes(python: Python, wheel: Path, folder: Path) -> dict[str, str]:
    """Return what became of each check, and print why one failed."""
    programs = python.environment(folder / "environment", str(wheel))
    own = folder / "outside"
    own.mkdir()
    places = dict.fromkeys(CHECKS, Place(programs=programs, folder=own))
    results = {}
    for name, check in (*CHECKS.items(), ("not writable", not_writable)):
        place = places.get(name) or unprivileged(programs, folder / "unprivileged")
        try:
            check(place)
        except (Failure, subprocess.TimeoutExpired, OSError) as error:
            results[name] = "FAILED"
            print(f"\nPython {python.name}, {name}: {error}\n", flush=True)
        else:
            results[name] = "ok"
    return results


def main() -> None:
    """Check with the Pythons named on the command line, or with all."""
    names = (*CHECKS, "not writable")
    failed = False
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        folder.chmod(0o755)  # for users other than this one
        found = pythons(sys.argv[1:])
        wheel = built(found[0], folder)
        check_content(wheel)
        print("Python  ", *(f"{name:>12}" for name in names), flush=True)
        for python in found:
            results = outcomes(python, wheel, folder / python.name)
            failed |= "FAILED" in results.values()
            print(f"{python.name:8}", *(f"{results[name]:>12}" for name in names), flush=True)
    if failed:
        sys.exit("The wheel does not work everywhere: see above.")


if __name__ == "__main__":
    main()
