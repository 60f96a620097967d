"""Episodes that go on in forked children, whose parent's threads do not exist there."""

import gc
import multiprocessing
import os

import numpy as np
import pytest

from defmanip_gym import get_state
from defmanip_gym.params import BeamRanges, DisturbanceParams

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
PATIENCE_S = 60


def in_a_fork(task, *arguments):
    """Return what a forked child returns; fail if it hangs or dies."""
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    child = context.Process(target=lambda: queue.put(task(*arguments)))
    child.start()
    child.join(PATIENCE_S)
    hangs = child.is_alive()
    child.kill()
    assert not hangs and child.exitcode == 0
    return queue.get()


def future(env):
    rng = np.random.default_rng(0)
    return [
        [np.array(part).tolist() for part in env.step(rng.uniform(-1, 1, (4, 3)))[:4]]
        for _ in range(30)
    ]


def test_a_batch_goes_on_alike_in_parent_and_child(make_batch):
    env = make_batch(
        4,
        num_threads=2,
        autoreset_mode="SameStep",
        max_episode_steps=12,
        beam_ranges=BeamRanges(mass_kg=(0.5, 2.0), length_m=(0.5, 0.8)),
        disturbance=DisturbanceParams(force_bias_n=0.5, force_sensor_noise_n=0.1),
    )
    env.reset(seed=0)
    future(env)
    in_child = in_a_fork(future, env)
    assert future(env) == in_child


def test_a_child_starts_new_episodes_first(make_batch):
    env = make_batch(4, num_threads=2, beam_ranges=BeamRanges(mass_kg=(0.5, 2.0)))
    env.reset(seed=0)

    def started():
        return env.reset(seed=3)[0].tolist()

    assert in_a_fork(started) == started()


def test_a_child_that_drops_a_batch_ends(make_batch):
    env = [make_batch(4, num_threads=2)]
    env[0].reset(seed=0)

    def drop():
        env.clear()
        gc.collect()
        return "dropped"

    assert in_a_fork(drop) == "dropped"


def test_a_child_of_a_child_goes_on_as_well(make_batch):
    env = make_batch(4, num_threads=2)
    env.reset(seed=0)
    expected = in_a_fork(future, env)

    def step_and_fork():
        state = get_state(env)
        future(env)
        env.unwrapped.set_state(state["episodes"])
        return in_a_fork(future, env)

    assert in_a_fork(step_and_fork) == expected
