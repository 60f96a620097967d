"""One controller on many scenarios of one condition, all in one batch."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import Controller, State
from defmanip_gym.baselines.factories import is_own, what_was_raised
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import ActionError, ControllerError, DefmanipError
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM
from defmanip_gym.evaluation.course import Course, CourseRecorder
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.measures import episode_record
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.suites import Scenario
from defmanip_gym.evaluation.traces import Trace, trace_of
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.validation import number_array, require_positive
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

ACTION_SIZE = 3  # in task mode


@dataclass(frozen=True, kw_only=True)
class Episode:
    """What is kept of an episode; the trace only where it was wanted."""

    record: EpisodeRecord
    trace: Trace | None


class AppliedActions(gymnasium.vector.VectorWrapper[Array, Array, Array, Array, Array]):
    """Keeps the actions that arrive here: those that take effect."""

    keeps_actions = True
    actions: Array

    def step(self, actions: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Keep the actions and step."""
        self.actions = np.clip(actions, -1.0, 1.0)
        return self.env.step(actions)


def rollout(
    entry: Entry,
    controller: Controller,
    scenarios: Sequence[Scenario],
    *,
    config: TransportConfig,
    horizon_s: float,
    safety_filter: SafetyFilter | None = None,
    delay_periods: int = 0,
    traced: Collection[str] = (),
    nominal_beam: BeamParams = NOMINAL_BEAM,
    num_threads: int = 0,
) -> tuple[Episode, ...]:
    """Run a controller from every scenario's start; an episode's record depends on nothing else.

    Args:
        entry: who this is, for the records.
        controller: row i of its batches is scenario i throughout.
        scenarios: at least one.
        config: the environment; in ``constraint_mode="cost"`` exceeding σ does not end episodes.
        horizon_s: simulated time after which an episode times out.
        safety_filter: around the environment; None runs without one.
        delay_periods: control periods by which actions, filtered ones too, take effect later.
        traced: names of scenarios whose time course is wanted.
        nominal_beam: what force errors are measured against.
        num_threads: physics threads, 0 for one per CPU.

    Returns:
        The episodes in the order of the scenarios.

    Raises:
        ControllerError: what somebody else's ``predict`` raised.
        ActionError: a controller's action has another shape or is not finite.
    """
    horizon_s = require_positive("horizon_s", horizon_s, "s")
    happened = courses(
        controller,
        [scenario.seed for scenario in scenarios],
        starts=np.array([scenario.start for scenario in scenarios]),
        config=config,
        steps=max(1, round(horizon_s / config.task.control_period_s)),
        safety_filter=safety_filter,
        delay_periods=delay_periods,
        num_threads=num_threads,
    )
    episodes = []
    for scenario, course in zip(scenarios, happened, strict=True):
        record = episode_record(course, entry, scenario, config, nominal_beam=nominal_beam)
        wanted = scenario.name in traced
        trace = trace_of(course, entry, scenario.name, config) if wanted else None
        episodes.append(Episode(record=record, trace=trace))
    return tuple(episodes)


def courses(
    controller: Controller,
    seeds: Sequence[int],
    *,
    config: TransportConfig,
    steps: int,
    starts: Array | None = None,
    safety_filter: SafetyFilter | None = None,
    delay_periods: int = 0,
    num_threads: int = 0,
) -> tuple[Course, ...]:
    """Run a controller in a batch of episodes and return what happened in each.

    Episodes that have ended stay in the batch with action zero and their last observation, and
    nothing of them counts any more.

    Args:
        controller: row i of its batches is episode i throughout.
        seeds: of the episodes, at least one.
        config: the environment.
        steps: control periods after which an episode times out.
        starts: (n, 6), m and rad; drawn from the seeds by default.
        safety_filter: around the environment; None runs without one.
        delay_periods: control periods by which actions, filtered ones too, take effect later.
        num_threads: physics threads, 0 for one per CPU.

    Raises:
        ControllerError: what somebody else's ``predict`` raised.
        ActionError: a controller's action has another shape or is not finite.
    """
    count = len(seeds)
    transport = _environment(config, count, steps, num_threads)
    applied = AppliedActions(transport)
    env: gymnasium.vector.VectorEnv[Array, Array, Array] = applied
    if delay_periods:
        env = ActionDelay(env, delay_periods)
    if safety_filter is not None:
        env = SafetyFilterVectorWrapper(env, safety_filter)
    observation, info = env.reset(
        seed=list(seeds),  # type: ignore[arg-type]
        options=None if starts is None else {"start": starts},
    )
    recorder = CourseRecorder(transport.engine, observation, info, steps)
    running = np.ones(count, dtype=bool)
    episode_start, state = running.copy(), None
    try:
        while running.any():
            decided, state = _decision(controller, observation, state, episode_start)
            actions = np.where(running[:, None], _checked(decided, count), 0.0)
            episode_start = np.zeros_like(running)
            after, reward, terminated, truncated, info = env.step(actions)
            observation = np.where(running[:, None], after, observation)
            ended: BoolArray = np.asarray(terminated, dtype=bool)
            recorder.add(running, actions, applied.actions, observation, reward, ended, info)
            running = running & ~np.logical_or(terminated, truncated)
    finally:
        env.close()
    return tuple(recorder.course(index) for index in range(count))


def _decision(
    controller: Controller,
    observation: Array,
    state: State | None,
    episode_start: BoolArray,
) -> tuple[object, State | None]:
    """Return a controller's actions and state; what others' code raises as an error of ours."""
    try:
        actions, state = controller.predict(observation, state, episode_start, deterministic=True)
    except Exception as error:
        kind = type(controller)
        if isinstance(error, DefmanipError) or is_own(kind.__module__):
            raise
        raise ControllerError(
            "predict of the controller",
            f"{kind.__module__}:{kind.__qualname__}",
            "predict(observation, state, episode_start, deterministic) → (actions, state)",
            what_was_raised(error),
        ) from error
    return actions, state


def _checked(actions: object, count: int) -> Array:
    """Return a controller's actions, clipped; NaN and infinity are the environment's to refuse."""
    values = number_array(actions)
    if values is None or values.shape != (count, ACTION_SIZE):
        raise ActionError(
            "action",
            actions if values is None else f"an array of shape {values.shape}",
            f"numbers of shape {(count, ACTION_SIZE)}, a row for each episode",
            "A controller's predict gets a batch of observations, (n, size).",
        )
    return np.clip(values, -1.0, 1.0)


def _environment(
    config: TransportConfig, count: int, steps: int, num_threads: int
) -> DeformTransportVectorEnv:
    return DeformTransportVectorEnv(
        count,
        max_episode_steps=steps,
        autoreset_mode=AutoresetMode.DISABLED,
        num_threads=num_threads,
        control_mode=config.control_mode,
        inner_loop=config.inner_loop,
        constraint_mode=config.constraint_mode,
        sigma_rad=config.sigma_rad,
        robot=config.robot,
        payload=config.payload,
        nominal_robot=config.nominal_robot,
        task=config.task,
        disturbance=config.disturbance,
        disturbance_ranges=config.disturbance_ranges,
    )
