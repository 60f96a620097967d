"""One controller on many scenarios, all in one batch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.scenarios import Scenario
from defmanip_gym.evaluation.tally import EpisodeTally
from defmanip_gym.evaluation.traces import Trace, TraceRecorder
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.validation import require_positive
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class AppliedActions(gymnasium.vector.VectorWrapper[Array, Array, Array, Array, Array]):
    """Keeps the actions that arrive here: under the ν_max wrapper, those that it let through."""

    actions: Array

    def step(self, actions: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Keep the actions and step."""
        self.actions = np.clip(actions, -1.0, 1.0)
        return self.env.step(actions)


def rollout(
    contestant: str,
    controller: Controller,
    scenarios: Sequence[Scenario],
    *,
    config: TransportConfig,
    horizon_s: float,
    certificate: Certificate | None = None,
    traced: Collection[str] = (),
    on_finished: Callable[[EpisodeRecord, Trace | None], None],
    on_step: Callable[[], None],
) -> None:
    """Run a controller from every scenario's start; an episode's record depends on nothing else.

    Episodes that have ended stay in the batch with action zero and their last observation, and
    nothing of them counts any more.

    Args:
        contestant: name for the records.
        controller: row i of its batches is scenario i throughout.
        scenarios: at least one.
        config: the environment; in ``constraint_mode="cost"`` exceeding σ does not end episodes.
        horizon_s: simulated time after which an episode times out.
        certificate: enforced by the ν_max wrapper; None runs without the wrapper.
        traced: names of scenarios whose time course is wanted.
        on_finished: gets record and, if wanted, trace as soon as an episode has ended.
        on_step: called after every control period of the batch.
    """
    applied = AppliedActions(_environment(config, len(scenarios), horizon_s))
    env: gymnasium.vector.VectorEnv[Array, Array, Array] = applied
    if certificate is not None:
        env = NuMaxVectorActionScaling(applied, certificate)
    observation, info = env.reset(
        seed=[scenario.seed for scenario in scenarios],  # type: ignore[arg-type]
        options={"start": np.array([scenario.start for scenario in scenarios])},
    )
    tally = EpisodeTally(observation, info, config)
    traces = TraceRecorder(contestant, scenarios, traced, config)
    running = np.ones(len(scenarios), dtype=bool)
    episode_start, state = running.copy(), None
    try:
        while running.any():
            actions, state = controller.predict(
                observation, state, episode_start, deterministic=True
            )
            episode_start = np.zeros_like(running)
            before, margin = observation, info["constraint_margin"]
            after, reward, terminated, truncated, info = env.step(
                np.where(running[:, None], actions, 0.0)
            )
            observation = np.where(running[:, None], after, before)
            traces.add(before, margin, applied.actions)
            tally.add(running, observation, reward, info)
            ended = running & np.logical_or(terminated, truncated)
            running = running & ~ended
            for index in np.flatnonzero(ended).tolist():
                record = tally.record(index, contestant, scenarios[index])
                last = observation, info["constraint_margin"], applied.actions
                on_finished(record, traces.finish(index, *last))
            on_step()
    finally:
        env.close()


def _environment(config: TransportConfig, count: int, horizon_s: float) -> DeformTransportVectorEnv:
    require_positive("horizon_s", horizon_s, "s")
    return DeformTransportVectorEnv(
        count,
        max_episode_steps=max(1, round(horizon_s / config.task.control_period_s)),
        autoreset_mode=AutoresetMode.DISABLED,
        control_mode=config.control_mode,
        constraint_mode=config.constraint_mode,
        sigma_rad=config.sigma_rad,
        robot=config.robot,
        beam=config.beam,
        nominal_robot=config.nominal_robot,
        nominal_beam=config.nominal_beam,
        task=config.task,
        disturbance=config.disturbance,
    )
