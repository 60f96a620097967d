"""Machine code is current, and computes what the source says."""

import ast
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest

import defmanip_gym
from defmanip_gym.compiled import (
    chosen_by_type,
    compilable,
    compiled,
    compiled_sources,
    sources_stamp,
)
from defmanip_gym.plant.rod_body import read_rod

EPISODE = """
import gymnasium, numpy as np
env = gymnasium.make_vec(
    "defmanip_gym:DeformTransport-v0", num_envs=2, control_mode="{mode}", max_episode_steps=8
)
observation, _ = env.reset(seed=3)
total = np.zeros(2)
for action in np.random.default_rng(0).uniform(-0.5, 0.5, (20, *env.action_space.shape)):
    observation, reward, *_ = env.step(action)
    total += reward
print(" ".join(f"{{value:.12e}}" for value in (*observation.ravel(), *total)))
"""


def test_stamp_changes_with_compiled_sources_and_constants_only(tmp_path):
    def stamp(name, **changes):
        package = tmp_path / name
        (package / "part").mkdir(parents=True)
        sources = {
            "params": "G = 9.81",
            "callee": "from x.compiled import compiled",
            "other": "A = 1",
        }
        for module, text in {**sources, **changes}.items():
            folder = package if module == "params" else package / "part"
            (folder / f"{module}.py").write_text(text)
        return sources_stamp(package)

    first = stamp("first")
    assert first == stamp("elsewhere", other="A = 2")
    assert first != stamp("edited", callee="from x.compiled import compilable")
    assert first != stamp("on the moon", params="G = 1.62")


def test_every_module_with_compiled_functions_counts():
    package = Path(defmanip_gym.__file__).parent
    importing = {
        path
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom) and node.module == "defmanip_gym.compiled"
    }
    assert len(importing) > 10
    assert importing <= set(compiled_sources(package))


def test_machine_code_of_another_signature_is_not_taken():
    @compiled
    def doubled(x):
        return 2 * x

    integer, real = numba.int64, numba.float64
    doubled.compile((integer,))
    doubled.compile((real,))
    cache = doubled._cache
    files = {key[0]: name for key, name in cache._cache_file._load_index().items()}
    folder = Path(cache._cache_path)
    (folder / files[(real,)]).write_bytes((folder / files[(integer,)]).read_bytes())
    assert cache.load_overload((integer,), doubled.targetctx) is not None
    assert cache.load_overload((real,), doubled.targetctx) is None
    for name in files.values():
        (folder / name).unlink()
    cache.flush()


def run(script, **environment):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


LIMIT = """
import numpy as np
from defmanip_gym.theory.control.control_laws import _limit_speeds, limit_speed
def limit():
    limited = limit_speed(np.array((8.0, 0.0, 0.0)), np.zeros(3), 1.0, 0.25)
    assert limited.tolist() == [4.0, 0.0, 0.0]
"""
CHILDREN = """
if __name__ == "__main__":
    import multiprocessing, threading
    children = [multiprocessing.get_context("fork").Process(target=limit) for _ in range(2)]
    for child in children: child.start()
    for child in children: child.join()
    assert [child.exitcode for child in children] == [0, 0], children
    threads = [threading.Thread(target=limit) for _ in range(4)]
    for thread in threads: thread.start()
    for thread in threads: thread.join()
    assert _limit_speeds.overloads
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_forked_children_and_threads_compile_first(tmp_path):
    done = run(LIMIT + CHILDREN, NUMBA_CACHE_DIR=str(tmp_path))
    assert done.returncode == 0, done.stderr


COMPILING = """
import multiprocessing, threading, time
import numba
from numba.core import event
begun = threading.Event()
class Listener(event.Listener):
    def on_start(self, event): begun.set()
    def on_end(self, event): pass
@numba.njit
def long(values):
    return np.linalg.svd(np.sort(values))[0].sum()
if __name__ == "__main__":
    listener = Listener()
    event.register("numba:run_pass", listener)
    compiling = threading.Thread(target=long, args=(np.ones((2, 2)),))
    compiling.start()
    begun.wait()
    event.unregister("numba:run_pass", listener)
    child = multiprocessing.get_context("fork").Process(target=limit)
    child.start()
    child.join(60)
    hangs = child.is_alive()
    child.kill()
    assert not hangs and child.exitcode == 0
    compiling.join()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_child_forked_while_another_thread_compiles_can_compile(tmp_path):
    done = run(LIMIT + COMPILING, NUMBA_CACHE_DIR=str(tmp_path))
    assert done.returncode == 0, done.stderr


def test_compiling_is_told_once_and_only_when_nothing_was_kept(tmp_path):
    first, second = (run(LIMIT + "limit()", NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert first.returncode == second.returncode == 0, first.stderr
    assert first.stderr.count("defmanip_gym: compiling") == 1
    assert "kept for the next time" in first.stderr
    assert first.stdout == second.stdout == second.stderr == ""


def test_where_nothing_can_be_kept_the_user_is_told_the_remedy(tmp_path):
    (tmp_path / "file").write_text("no folder")
    refusing = "import numba; numba.config.CACHE_LOCATOR_CLASSES = 'UserProvidedCacheLocator'\n"
    done = run(refusing + LIMIT + "limit()", NUMBA_CACHE_DIR=str(tmp_path / "file"))
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("NUMBA_CACHE_DIR") == 1


def test_a_killed_process_leaves_no_machine_code_of_other_sources():
    @compiled
    def halved(x):
        return x / 2

    halved.compile((numba.float64,))
    cache, files = halved._cache, halved._cache._cache_file
    (name,), folder = files._load_index().values(), Path(cache._cache_path)
    stamp = sources_stamp(Path(defmanip_gym.__file__).parent)
    assert stamp in name
    (folder / name).write_bytes((folder / name).read_bytes()[:100])
    assert cache.load_overload((numba.float64,), halved.targetctx) is None
    left = folder / name.replace(stamp, "another")
    left.write_bytes(b"")
    cache.save_overload((numba.float64,), next(iter(halved.overloads.values())))
    assert cache.load_overload((numba.float64,), halved.targetctx) is not None
    assert not left.exists()
    (folder / name).unlink()
    cache.flush()


def test_machine_code_on_disk_is_dated_by_all_compiled_sources():
    package = Path(defmanip_gym.__file__).parent
    assert read_rod._cache._cache_file._source_stamp == sources_stamp(package)


def numbers(mode, before="", **environment):
    """Return what an episode in another process comes to."""
    done = subprocess.run(
        [sys.executable, "-c", before + EPISODE.format(mode=mode)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return np.array(done.stdout.split(), dtype=float)


def test_compiled_and_interpreted_steps_agree():
    for mode in ("task", "force"):
        interpreted = numbers(mode, NUMBA_DISABLE_JIT="1")
        np.testing.assert_allclose(numbers(mode), interpreted, rtol=1e-9, atol=1e-9)


def test_another_numba_compiles_in_its_own_way_to_the_same_results(tmp_path):
    another = """
import sys, numba
numba.__version__ = "1.0.0"
import defmanip_gym.compiled
assert "defmanip_gym.compiler" not in sys.modules
"""
    found = numbers("task", another, NUMBA_CACHE_DIR=str(tmp_path))
    assert np.array_equal(found, numbers("task"))


class One(NamedTuple):
    value: float


class Two(NamedTuple):
    value: float


def test_a_function_is_chosen_by_type_in_compiled_code_and_in_python():
    @compilable
    def double(each, factor):
        return 2.0 * factor * each.value

    @compilable
    def square(each, factor):
        return factor * each.value**2

    chosen = chosen_by_type({One: double, Two: square})

    @compiled
    def both(one, two):
        return chosen(one, 1.0), chosen(two, 1.0)

    expected = (chosen(One(3.0), 1.0), chosen(Two(3.0), 1.0))
    assert both(One(3.0), Two(3.0)) == expected == (6.0, 9.0)
