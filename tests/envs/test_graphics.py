"""Images are a lone environment's, whatever else draws, closes, ends or forks."""

import gc
import itertools
import os
import subprocess
import sys
import threading

import gymnasium
import numpy as np
import pytest

from defmanip_gym.envs.rendering.graphics import GraphicsThread
from defmanip_gym.errors import RenderingError

pytestmark = pytest.mark.usefixtures("opengl")

forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="only POSIX forks")

ENV_ID = "DeformTransport-v0"
SMALL = {"width": 40, "height": 30}


def single(seed, mode="rgb_array", **arguments):
    env = gymnasium.make(ENV_ID, render_mode=mode, **SMALL, **arguments)
    env.reset(seed=seed)
    return env


def batch(seed, mode="rgb_array"):
    env = gymnasium.make_vec(ENV_ID, num_envs=2, render_mode=mode, **SMALL)
    env.reset(seed=seed)
    return env


def image(env):
    return np.array(env.render())


MAKERS = [
    lambda: single(0),
    lambda: single(1, "depth_array"),
    lambda: batch(2),
    lambda: batch(3, "depth_array"),
]


@pytest.fixture(scope="module")
def lone():
    """Return the images of each kind of environment when there is no other."""
    images = []
    for make in MAKERS:
        env = make()
        images.append(image(env))
        env.close()
    return images


@pytest.mark.parametrize("pair", [(0, 0), (0, 1), (0, 2), (2, 3)])
@pytest.mark.parametrize("made", ["first", "when drawn"])
def test_two_environments_may_be_made_drawn_and_closed_in_any_order(pair, made, lone):
    for order in set(itertools.permutations([0, 0, 1, 1])):  # twice: to be drawn, then closed
        envs = [MAKERS[kind]() for kind in pair] if made == "first" else [None, None]
        is_open = [False, False]
        for which in order:
            if is_open[which]:
                envs[which].close()
            else:
                envs[which] = envs[which] or MAKERS[pair[which]]()
            is_open[which] = not is_open[which]
            for i in np.flatnonzero(is_open):
                np.testing.assert_array_equal(image(envs[i]), lone[pair[i]], str(order))


@pytest.mark.parametrize("kinds", [(0, 1, 2), (3, 2, 0)])
def test_three_environments_may_be_closed_in_any_order(kinds, lone):
    envs = [MAKERS[kind]() for kind in kinds]
    for order in itertools.permutations(range(3)):
        for i in range(3):  # a closed environment that is drawn again opens again
            np.testing.assert_array_equal(image(envs[i]), lone[kinds[i]])
        for closed in range(3):
            envs[order[closed]].close()
            for i in order[closed + 1 :]:
                np.testing.assert_array_equal(image(envs[i]), lone[kinds[i]], str(order))


def test_discarding_an_environment_unclosed_leaves_the_others(lone):
    env, other = single(0), single(5)
    other.render()
    del other
    gc.collect()
    np.testing.assert_array_equal(image(env), lone[0])
    env.close()


def test_what_an_unclosed_environment_drew_with_is_freed():
    env = single(0)
    env.render()
    stage = env.unwrapped._renderer._stage
    free, opengl = stage._free, stage._opengl
    assert free.alive
    del env, stage
    gc.collect()
    single(0).render()  # what is freed is freed before the next image
    assert not free.alive and opengl._context is None


def test_gymnasiums_own_environments_and_ours_leave_each_other_alone(lone, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "egl")  # it tries GLFW first, which fails without a display
    env = single(0)
    env.render()
    cheetah = gymnasium.make("HalfCheetah-v5", render_mode="rgb_array", width=40, height=30)
    cheetah.reset(seed=0)
    first = cheetah.render()
    np.testing.assert_array_equal(image(env), lone[0])
    np.testing.assert_array_equal(cheetah.render(), first)
    env.close()
    np.testing.assert_array_equal(cheetah.render(), first)
    cheetah.close()
    del cheetah
    gc.collect()
    np.testing.assert_array_equal(image(env), lone[0])
    env.close()


def test_any_thread_may_draw_and_several_at_once(lone):
    makers, seen = MAKERS * 2, {}
    envs = [make() for make in makers]
    envs[0].render()

    def draw(index):
        seen[index] = [image(envs[index]) for _ in range(5)]
        envs[index].close()

    threads = [threading.Thread(target=draw, args=(index,)) for index in range(len(envs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for index, images in seen.items():
        for each in images:
            np.testing.assert_array_equal(each, lone[index % 4])
    assert len(seen) == len(envs)


def test_errors_reach_the_thread_that_asked_and_the_next_image_is_drawn():
    graphics = GraphicsThread()
    with pytest.raises(ZeroDivisionError):
        graphics.run(lambda: 1 // 0)
    assert graphics.run(lambda: 7) == 7


def test_without_opengl_there_is_an_error_until_there_is_one(monkeypatch, lone):
    env = single(0)
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(RenderingError, match="MUJOCO_GL"):
        env.render()
    monkeypatch.delenv("MUJOCO_GL")
    np.testing.assert_array_equal(image(env), lone[0])
    env.close()


SCRIPT = """
import os, signal, sys, warnings, gymnasium, defmanip_gym
warnings.filterwarnings("ignore", message=".*out of date")  # v0 beside v1
from defmanip_gym.errors import RenderingError

def draw():
    env = gymnasium.make("DeformTransport-v0", render_mode="rgb_array", width=40, height=30)
    env.reset(seed=0)
    return env, env.render()

def in_child(work):
    child = os.fork()
    if not child:
        signal.alarm(60)  # one that hangs is no one's
        try:
            work()
        except RenderingError as error:
            os._exit(3 if "spawn" in str(error) else 4)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

"""


def run(script):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", SCRIPT + script],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout.split()


@forks
def test_a_forked_child_draws_if_its_parent_has_not_and_else_says_what_to_do():
    assert run("print(in_child(draw)); draw(); print(in_child(draw))") == ["0", "3"]


@pytest.mark.skipif(sys.platform != "linux", reason="EGL is Linux's")
def test_a_forked_child_also_notices_what_its_parent_drew_without_this_package():
    script = """
gymnasium.make("DeformTransport-v0")
from mujoco.egl import GLContext
context = GLContext(1, 1)
print(in_child(draw))
"""
    assert run(script) == ["3"]


@forks
def test_a_parent_goes_on_drawing_when_its_children_have_ended():
    script = """
env, first = draw()
print(in_child(env.close), in_child(lambda: sys.exit(0) if env.close() else None))
print((env.render() == first).all())
"""
    assert run(script) == ["0", "0", "True"]


def test_python_ends_quietly_with_environments_that_nobody_closed():
    assert run("env, first = draw(); other, second = draw(); print(first.std() > 1)") == ["True"]


def test_spawned_workers_draw_after_the_parent_has(lone):
    single(0).render()
    envs = gymnasium.vector.AsyncVectorEnv([lambda: single(0)], context="spawn")
    envs.reset(seed=0)
    np.testing.assert_array_equal(envs.render()[0], lone[0])
    envs.close()
