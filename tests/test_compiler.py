"""What comes out of the leaner compiler is what Python computes."""

import gc
import os
import subprocess
import sys

import numba
import numpy as np
import pytest

from defmanip_gym.compiled import without_garbage_collection
from defmanip_gym.compiler import KernelCompiler


def kernel(function):
    options = {"error_model": "numpy", "_nrt": False, "pipeline_class": KernelCompiler}
    return numba.njit(**options)(function)


def touch(values, places, flags, cube):
    for i in range(len(places)):
        values[places[i], -1] += values[-1 - i, 1]
        flags[i] = values[i, 0] > 0.5 and not flags[i]
        cube[i, -2, 1] = values[i, i]
        places[i] = len(places) - places[i]
    row = values[0]
    row[1] = cube[-1, 0, 1] if flags[-1] else row[-2]


@pytest.mark.parametrize("stride", [1, 2])
def test_elements_are_those_that_python_names(stride):
    def arguments():
        rng = np.random.default_rng(0)
        everything = (
            rng.random((4 * stride, 3 * stride)),
            np.arange(3 * stride) - 2,
            rng.random(3 * stride) > 0.5,
            rng.random((3 * stride, 2 * stride, 2 * stride)),
        )
        return [values[(slice(None, None, stride),) * values.ndim] for values in everything]

    compiled, interpreted = arguments(), arguments()
    kernel(touch)(*compiled)
    touch(*interpreted)
    for result, expected in zip(compiled, interpreted, strict=True):
        np.testing.assert_array_equal(result, expected)


def wander(values):
    largest = shift = 0.0
    first = values[0]
    for k in range(len(values)):
        value = values[k]
        if value > largest:
            step = value - largest
            largest = value
        for _ in range(2):
            shift += value - first
    return 1000 * value + 100 * step + 10 * shift + largest


def test_variables_hold_over_branches_and_turns_of_loops():
    values = np.array((3.0, 7.0, 5.0))
    assert kernel(wander)(values) == wander(values)


def count(first, stop, step):
    total, turns = 0, range(first, stop)
    for k in turns:
        total += 100 * k + 1
    for k in range(stop):
        total += 10_000 * k + 1
    for k in range(first, stop, step):
        total += 1_000_000 * k + 1
    return total


@pytest.mark.parametrize("limits", [(3, 3, 1), (7, 2, -2), (2, 7, 2), (2, 8, 3), (-4, -1, 1)])
def test_loops_count_as_in_python(limits):
    assert kernel(count)(*limits) == count(*limits)


def combine(x, y, n):
    total = x * y - n * x + 2 * y
    total -= x**2 + y**3 - n**2 * x
    total *= 1 + x**n - y**-2
    return total, n**2 + n, n - 2 * n, x**0.5 + x**2.0


def test_numbers_are_those_of_python():
    compiled = kernel(combine)
    for x, y in np.random.default_rng(1).uniform(0.1, 3.0, (50, 2)):
        assert compiled(x, y, 3)[:3] == pytest.approx(combine(x, y, 3)[:3], rel=1e-15)
        assert compiled(x, y, 3)[3] == combine(x, y, 3)[3]


COLD = """
import collections, gymnasium
from numba.core import event
compiled = collections.Counter()
class Listener(event.Listener):
    def on_start(self, event):
        function = event.data["dispatcher"].py_func
        compiled[function.__module__, function.__qualname__] += 1
    def on_end(self, event): pass
event.register("numba:compile", Listener())
gymnasium.make("defmanip_gym:DeformTransport-v0").reset(seed=0)
ours = {name: count for name, count in compiled.items() if name[0].startswith("defmanip_gym")}
assert len(ours) > 20, ours
assert set(ours.values()) == {1}, ours
assert len(compiled) < len(ours) + 4, compiled
"""


def test_the_first_environment_compiles_each_function_once_and_hardly_any_of_numbas(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", COLD],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_garbage_is_collected_again_if_it_was_before():
    with without_garbage_collection():
        assert not gc.isenabled()
        with without_garbage_collection():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()
