"""What a single environment's step costs beyond its physics, ours and Gymnasium's.

Measured is one ``env.step`` as ``gymnasium.make`` returns the environment (its default wrappers
included) and of the unwrapped environment, without resets, against nothing but
``mj_step(model, data, nstep=frame_skip)`` on the same model. Gymnasium's environments and their
bare physics go through the same states: the first steps of an episode of one seed, over and over.
What an environment computes in MuJoCo after the last substep counts as beyond physics for all
(theirs mj_rnePostConstraint, ours the grasp force at the new state). Each turn counts with the
fastest tenth of its calls: the question is what a step needs, not what else the machine does.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import mujoco
import numpy as np

from environments import ENV_ID, StoredActions, batched_env
from physics_alone import one_core_physics
from turns import Candidate, Figure, Times, take_turns, undisturbed

MARKS = ("HalfCheetah-v5", "Hopper-v5", "InvertedDoublePendulum-v5")

_LONGEST_CYCLE = 64
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION.value


def beyond_physics(
    control_modes: tuple[str, ...], *, rounds: int, turn_s: float, **options: Any
) -> list[Figure]:
    """Return the microseconds beyond physics of our single environment and of the marks.

    Args:
        control_modes: of our environment.
        rounds: see ``take_turns``.
        turn_s: see there.
        options: of our environment.
    """
    candidates = []
    for mode in control_modes:
        candidates += _ours(mode, **options)
    for mark in MARKS:
        candidates += _mark(mark)
    times = take_turns(candidates, rounds=rounds, turn_s=turn_s, summary=undisturbed)
    ours = [f"DeformTransport-v0 {mode}" for mode in control_modes]
    figures = []
    for name in (*ours, *MARKS):
        bare = f"{name} physics"
        microseconds = 1e6 * times.seconds[bare]
        figures.append(Figure.of(bare, microseconds, "µs per step"))
        figures.append(times.beyond(name, bare))
        figures.append(times.beyond(f"{name} unwrapped", bare))
    for name in ours:
        for mark in MARKS:
            figures.append(_comparison(times, name, mark))
    return figures


def _comparison(times: Times, name: str, mark: str) -> Figure:
    ours = times.seconds[name] - times.seconds[f"{name} physics"]
    theirs = times.seconds[mark] - times.seconds[f"{mark} physics"]
    return Figure.of(f"{name} beyond physics", ours / theirs, f"× {mark}'s")


def _ours(mode: str, **options: Any) -> list[Candidate]:
    name = f"DeformTransport-v0 {mode}"
    physics = one_core_physics(
        f"{name} physics", batched_env(1, num_threads=1, control_mode=mode, **options)
    )
    env, bare = (gymnasium.make(ENV_ID, control_mode=mode, **options) for _ in range(2))
    return [physics, _replayed(name, env), _replayed(f"{name} unwrapped", bare.unwrapped)]


def _mark(name: str) -> list[Candidate]:
    env, bare, recorded = (_quietly_made(name) for _ in range(3))
    return [
        _recorded_physics(f"{name} physics", recorded),
        _replayed(name, env),
        _replayed(f"{name} unwrapped", bare.unwrapped),
    ]


def _quietly_made(name: str) -> gymnasium.Env[Any, Any]:
    """Return Gymnasium's environment; MuJoCo would log that the cheetah's file is of old style."""
    reporter = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        return gymnasium.make(name)
    finally:
        mujoco.set_mju_user_warning(reporter)


def _replayed(name: str, env: gymnasium.Env[Any, Any]) -> Candidate:
    """Return the same stretch of an episode, over and over; resets are not timed."""
    actions = StoredActions(env.action_space)
    ended, steps = True, 0

    def prepare() -> None:
        nonlocal ended, steps
        if ended or steps == _LONGEST_CYCLE:
            env.reset(seed=0)
            actions.rewind()
            ended, steps = False, 0

    def step() -> None:
        nonlocal ended, steps
        _, _, terminated, truncated, _ = env.step(next(actions))
        ended = terminated or truncated
        steps += 1

    return Candidate(name=name, prepare=prepare, step=step, close=env.close)


def _recorded_physics(name: str, env: gymnasium.Env[Any, Any]) -> Candidate:
    """Return the bare physics of the stretch that ``_replayed`` goes through."""
    plant: Any = env.unwrapped
    model, data, frame_skip = plant.model, plant.data, plant.frame_skip
    actions, states = StoredActions(env.action_space), []
    env.reset(seed=0)
    for _ in range(_LONGEST_CYCLE):
        action = next(actions)
        data.ctrl[:] = action
        states.append(np.empty(mujoco.mj_stateSize(model, _STATE)))
        mujoco.mj_getState(model, data, states[-1], _STATE)
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            break
    index = 0

    def prepare() -> None:
        nonlocal index
        mujoco.mj_setState(model, data, states[index], _STATE)
        index = (index + 1) % len(states)

    return Candidate(
        name=name,
        prepare=prepare,
        step=lambda: mujoco.mj_step(model, data, frame_skip),
        close=env.close,
    )
