"""The one engine: n episodes of the transport task, stepped together.

Both Gymnasium faces (``deform_transport`` for one, ``vector`` for n) are thin layers over it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from defmanip_gym.envs import task as transport
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.snapshot import (
    Snapshot,
    Surveyor,
    add_sensor_noise,
    clean_observation,
    frozen,
)
from defmanip_gym.envs.starts import check_starts, extreme_starts, requested_starts, sample_start
from defmanip_gym.envs.workspace import in_workspace
from defmanip_gym.errors import ActionError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.plant.simulation import PlantState, Simulation
from defmanip_gym.theory.control_laws import limit_speed
from defmanip_gym.theory.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.redundancy import RedundancyResolution

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Ids = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """What one control period brought; arrays over the n episodes."""

    observation: Array
    reward: Array
    terminated: BoolArray
    info: dict[str, Any]


class TransportEngine:
    """Physics, inner control loop, observation, reward and episode ends for n episodes.

    Args:
        config: the environment's definition.
        num_envs: n.
        num_threads: physics threads, 0 for one per CPU.
    """

    def __init__(self, config: TransportConfig, num_envs: int, num_threads: int = 0) -> None:
        check_starts(extreme_starts(config.task.start), config)
        self.config, self.num_envs = config, num_envs
        self.layout = ObservationLayout(config.beam.segment_count)
        self.action_size = 3 if config.control_mode == "task" else 4
        self._surveyor = Surveyor(config)
        self._force_limits = np.array(config.robot.force_limits)
        self._linearization = FeedbackLinearization(
            config.believed_robot,
            config.believed_beam,
            RedundancyResolution(
                config.believed_robot, goal_reach_m=config.goal_reach_and_height_m[0]
            ),
        )
        self.simulation = Simulation(
            config.robot,
            config.beam,
            count=num_envs,
            goal_position_m=config.goal_position_m,
            physics_period_s=config.task.physics_period_s,
            num_threads=num_threads,
        )
        self._generators = [np.random.default_rng(None) for _ in range(num_envs)]
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._now: Snapshot

    @property
    def steps(self) -> NDArray[np.int64]:
        """Control periods since the start of each episode, (n,)."""
        return self._steps

    @property
    def largest_swing_rad(self) -> Array:
        """‖z2‖∞ of each episode, (n,)."""
        return self._now.task.largest_swing_rad

    @property
    def plant_state(self) -> PlantState:
        """The true state, for evaluation and drawing; controllers see observations only."""
        return self._now.plant

    def reset(
        self,
        ids: Ids | None = None,
        *,
        seeds: Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start new episodes and return observation and info of all n.

        Args:
            ids: which episodes; all by default.
            seeds: a seed for each of them; ``None`` goes on with its generator.
            options: ``{"start": "sampled" | "paper" | six numbers | (n, 6) numbers}``.

        Raises:
            StartError: the requested start cannot be taken.
        """
        ids = np.arange(self.num_envs) if ids is None else ids
        requested = requested_starts(options, self.num_envs)
        if requested is not None:
            check_starts(requested[ids], self.config)
        for index, seed in zip(ids, seeds or (), strict=bool(seeds)):
            if seed is not None:
                self._generators[index] = np.random.default_rng(seed)
        starts = (
            np.array([sample_start(self.config.task.start, self._generators[i]) for i in ids])
            if requested is None
            else requested[ids]
        )
        count = self.config.beam.segment_count
        joints, swing = starts[:, 3:5], np.repeat(starts[:, 5:], count, axis=1)
        still = np.zeros((len(ids), 2))
        self.simulation.place(ids, starts[:, :3], joints, swing)
        hold = self._linearization.generalized_forces(
            np.zeros((len(ids), 3)), joints, still, still, swing, np.zeros_like(swing)
        )
        self.simulation.hold(ids, hold)
        self._steps[ids] = 0
        self._now = self._snapshot()
        nothing = np.zeros(self.num_envs, dtype=bool)
        outcome = transport.Outcome(
            success=transport.is_success(self._now.task, self.config.task),
            violation=nothing,
            left_workspace=nothing,
            simulation_failed=nothing,
        )
        zeros = np.zeros(self.num_envs)
        terms = dict.fromkeys(_REWARD_TERMS, zeros)
        return self._observation(ids), self._info(outcome, terms, zeros)

    def step(self, actions: Array) -> StepResult:
        """Advance all episodes by one control period.

        Args:
            actions: (n, 3) task accelerations over ``max_acceleration_m_s2`` in the base frame,
                or (n, 4) forces over the actuator limits; values beyond ±1 are clipped.

        Raises:
            ActionError: wrong shape or values that are not finite.
            ResetNeeded: no episode has been started.
        """
        config, task = self.config, self.config.task
        if not hasattr(self, "_now"):
            raise ResetNeeded("Call reset() before the first step().")
        actions = self._checked(actions)
        self.simulation.apply(self._generalized_forces(actions))
        if config.disturbance.has_force:
            self.simulation.push_grasp(self._disturbing_force())
        failed = self.simulation.step(task.substeps)
        before = transport.potentials(self._now.task, task)
        self._steps += 1
        self._now = self._snapshot(failed)
        state = self._now.task
        excess = -np.minimum(transport.constraint_margin(state, config.sigma_rad), 0.0)
        outcome = transport.Outcome(
            success=transport.is_success(state, task) & ~failed,
            violation=excess > 0,
            left_workspace=~failed
            & ~in_workspace(self._now.plant.base_pose, self._now.plant.joints, config),
            simulation_failed=failed,
        )
        ends = config.constraint_mode == "terminate"
        penalized = excess / config.sigma_rad if config.constraint_mode == "penalty" else 0 * excess
        terms = transport.reward_terms(
            before=before,
            after=transport.potentials(state, task),
            action=actions,
            outcome=outcome,
            violation_ends=ends,
            excess_share=penalized,
            weights=task.reward,
        )
        terminated = outcome.success | outcome.failure
        if ends:
            terminated = terminated | outcome.violation
        excess_speed = np.maximum(state.speed_m_s - task.max_speed_m_s, 0.0)
        return StepResult(
            observation=self._observation(np.arange(self.num_envs)),
            # term by term: np.sum adds up in an order that depends on the batch size
            reward=reduce(np.add, terms.values()),
            terminated=terminated,
            info=self._info(outcome, terms, excess_speed),
        )

    def _checked(self, actions: Array) -> Array:
        shape = (self.num_envs, self.action_size)
        try:
            values = np.asarray(actions, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ActionError(
                "action", actions, f"numbers of shape {shape}", "Pass a NumPy array."
            ) from error
        if values.shape != shape:
            raise ActionError(
                "action shape",
                values.shape,
                f"{shape} in {self.config.control_mode!r} control mode",
                "Check the environment's action_space.",
            )
        if not np.isfinite(values).all():
            raise ActionError(
                "action",
                values.tolist() if self.num_envs == 1 else "an array with NaN or infinity",
                "finite numbers in [-1, 1]",
                "Look for a diverged policy or controller.",
            )
        return np.minimum(np.maximum(values, -1.0), 1.0)

    def _generalized_forces(self, actions: Array) -> Array:
        """Return T_r: directly, or from the task acceleration by Eq. (28)."""
        if self.config.control_mode == "force":
            return actions * self._force_limits
        task, now = self.config.task, self._now
        w = limit_speed(
            actions * task.max_acceleration_m_s2,
            now.grasp_velocity_b,
            task.max_speed_m_s,
            task.control_period_s,
        )
        plant = now.plant
        # the forces act for a whole period: take them where the motion will be half-way through it
        half = 0.5 * task.control_period_s
        return self._linearization.generalized_forces(
            w,
            plant.joints + half * plant.joint_rates,
            plant.joint_rates,
            plant.base_velocity,
            plant.swing + half * plant.swing_rate,
            plant.swing_rate,
        )

    def _disturbing_force(self) -> Array:
        disturbance = self.config.disturbance
        time_s = self._steps * self.config.task.control_period_s
        force = disturbance.force_bias_n + disturbance.force_amplitude_n * np.sin(
            disturbance.force_frequency_rad_s * time_s
        )
        return np.repeat(force[:, None], 3, axis=1)

    def _snapshot(self, failed: BoolArray | None = None) -> Snapshot:
        """Read the plant; failed simulations stay as they last were: finite and meaningful."""
        plant = self.simulation.read()
        if failed is not None and failed.any():
            plant = frozen(plant, self._now.plant, failed)
        return self._surveyor.snapshot(plant)

    def _observation(self, ids: Ids) -> Array:
        """Return observations of all episodes, drawing sensor noise for ``ids`` only."""
        observation = clean_observation(self._now)
        add_sensor_noise(observation, self.layout, self.config.disturbance, self._generators, ids)
        return observation

    def _info(
        self, outcome: transport.Outcome, terms: dict[str, Array], cost_speed: Array
    ) -> dict[str, Any]:
        state = self._now.task
        margin = transport.constraint_margin(state, self.config.sigma_rad)
        return {
            "is_success": outcome.success,
            "cost": (margin < 0).astype(np.float64),
            "cost_speed": cost_speed,
            "constraint_margin": margin,
            "left_workspace": outcome.left_workspace,
            "simulation_failed": outcome.simulation_failed,
            "distance_to_goal": state.distance_m,
            **terms,
        }


_REWARD_TERMS = (
    "reward_distance",
    "reward_course",
    "reward_closeness",
    "reward_time",
    "reward_effort",
    "reward_success",
    "reward_failure",
    "reward_deformation",
)
