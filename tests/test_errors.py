"""Errors arrive as they are, whatever carries them to whoever catches them."""

import copy
import multiprocessing
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

import gymnasium
import joblib
import numpy as np
import pytest

from defmanip_gym import errors

START_METHODS = ("fork", "spawn", "forkserver")
VALUE = {"mass": (1.5, None), "name": "beam"}


def every_kind(kind=errors.DefmanipError):
    yield kind
    for below in kind.__subclasses__():
        if below.__module__ == errors.__name__:
            yield from every_kind(below)


def example(kind, value=VALUE):
    if issubclass(kind, errors.InvalidValueError):
        return kind("mass_kg", value, "a number > 0", "Give kg.")
    return kind("no image can be made here")


KINDS = list(every_kind())
EVERY_KIND = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


def raise_one_of(kind):
    raise example(kind)


def raise_with_what_cannot_be_pickled():
    raise example(errors.ParameterError, lambda: None)


class RefusesActions(gymnasium.Env):
    observation_space = action_space = gymnasium.spaces.Box(-1, 1, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(1, np.float32), {}

    def step(self, action):
        raise_one_of(errors.ActionError)


def assert_same(error, other):
    assert type(error) is type(other)
    assert str(error) == str(other)
    assert vars(error) == vars(other)


def test_every_exception_of_the_package_is_among_those_tested():
    defined = {each for each in vars(errors).values() if isinstance(each, type)}
    assert {each for each in defined if issubclass(each, errors.DefmanipError)} == set(KINDS)


@EVERY_KIND
def test_pickles_and_copies_are_whole(kind):
    error = example(kind)
    error.add_note("while the beam was drawn")
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        assert_same(pickle.loads(pickle.dumps(error, protocol)), error)
    assert_same(copy.copy(error), error)
    assert_same(copy.deepcopy(error), error)


@EVERY_KIND
def test_class_called_with_an_error_of_its_own_raises_it_again(kind):
    error = example(kind)
    assert_same(kind(error), error)


class BreaksOnArrival:
    def __reduce__(self):
        return int, ("not a number",)


@pytest.mark.parametrize("value", [lambda: None, (i for i in ()), BreaksOnArrival()])
def test_value_that_cannot_travel_arrives_as_its_text(value):
    error = example(errors.StartError, value)
    arrived = pickle.loads(pickle.dumps(error))
    assert (arrived.value, str(arrived)) == (repr(value), str(error))
    assert copy.deepcopy(error).name == error.name


def test_value_that_cannot_travel_arrives_as_its_text_where_all_exceptions_are_tblibs():
    pytest.importorskip("tblib")
    code = (
        "import pickle; from tblib import pickling_support; from defmanip_gym.errors import *; "
        "pickling_support.install(); error = StartError('start', lambda: None, 'six', 'Give.'); "
        "arrived = pickle.loads(pickle.dumps(error)); "
        "assert (arrived.value, str(arrived)) == (repr(error.value), str(error))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_value_that_cannot_even_be_shown_does_not_break_the_error():
    assert "int that cannot be shown" in str(example(errors.ActionError, 10**5000))


def test_seed_errors_are_gymnasiums_too():
    assert issubclass(errors.SeedError, gymnasium.error.Error)


@pytest.mark.parametrize("method", START_METHODS)
def test_errors_leave_worker_processes(method):
    context = multiprocessing.get_context(method)
    with context.Pool(1) as pool:
        for kind in KINDS:
            with pytest.raises(kind) as caught:
                pool.apply_async(raise_one_of, (kind,)).get(timeout=60)
            assert vars(caught.value) == vars(example(kind))
    with ProcessPoolExecutor(1, mp_context=context) as executor:
        with pytest.raises(errors.ParameterError, match="lambda"):
            executor.submit(raise_with_what_cannot_be_pickled).result(timeout=60)


@pytest.mark.filterwarnings("ignore:.*ERROR")  # Gymnasium tells of the error as well
@pytest.mark.parametrize("method", START_METHODS)
def test_errors_leave_an_asynchronous_batch(method):
    batch = gymnasium.vector.AsyncVectorEnv([RefusesActions] * 2, context=method)
    batch.reset()
    with pytest.raises(errors.ActionError) as caught:
        batch.step(np.zeros((2, 1)))
    batch.close(terminate=True)
    assert_same(caught.value, example(errors.ActionError))


@pytest.mark.parametrize("backend", ["loky", "multiprocessing"])
def test_errors_leave_joblib(backend):
    with pytest.raises(errors.CertificateError) as caught:
        joblib.Parallel(2, backend=backend)(
            joblib.delayed(raise_one_of)(errors.CertificateError) for _ in range(2)
        )
    assert vars(caught.value) == vars(example(errors.CertificateError))
