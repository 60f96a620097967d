"""Running sums over a batch of episodes, each frozen when its episode ends."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.readings import position_from_goal
from defmanip_gym.evaluation.records import EpisodeRecord, Outcome
from defmanip_gym.evaluation.scenarios import Scenario
from defmanip_gym.observation import ObservationLayout

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class EpisodeTally:
    """What records need, updated once a step for the episodes that still run.

    Args:
        observation: of the reset, (n, size).
        info: of the reset.
        config: the environment's definition.
    """

    def __init__(self, observation: Array, info: dict[str, Any], config: TransportConfig) -> None:
        count = len(observation)
        self._layout = ObservationLayout(config.beam.segment_count)
        self._sigma_rad, self._period_s = config.sigma_rad, config.task.control_period_s
        self._position = position_from_goal(observation, self._layout)
        self._start_distance = info["distance_to_goal"].copy()
        self._distance = self._start_distance.copy()
        self._largest_swing = config.sigma_rad - info["constraint_margin"]
        self._peak_force = self._force_norm(observation)
        self._energy, self._path, self._return = np.zeros((3, count))
        self._steps = np.zeros(count, dtype=np.int64)
        self._intervened_steps, self._intervention_sum = np.zeros((2, count))
        self._success, self._left, self._failed = np.zeros((3, count), dtype=bool)
        self._applies: BoolArray | None = info.get("certificate_applies")

    def add(
        self, running: BoolArray, observation: Array, reward: Array, info: dict[str, Any]
    ) -> None:
        """Count one step of the episodes in ``running``, (n,)."""
        position = position_from_goal(observation, self._layout)
        velocity = self._layout.part(observation, "grasp_velocity_b")
        power = np.abs((self._layout.part(observation, "grasp_force_b") * velocity).sum(axis=1))
        self._steps += running
        self._energy += running * power * self._period_s
        self._path += running * np.sqrt(((position - self._position) ** 2).sum(axis=1))
        self._return += running * reward
        self._position = position
        self._distance = np.where(running, info["distance_to_goal"], self._distance)
        swing = self._sigma_rad - info["constraint_margin"]
        self._largest_swing = np.fmax(self._largest_swing, np.where(running, swing, 0.0))
        force = np.where(running, self._force_norm(observation), 0.0)
        self._peak_force = np.fmax(self._peak_force, force)
        self._success |= running & info["is_success"]
        self._left |= running & info["left_workspace"]
        self._failed |= running & info["simulation_failed"]
        if self._applies is not None:
            self._intervened_steps += running & info["intervened"]
            self._intervention_sum += running * info["intervention_m_s2"]

    def record(self, index: int, contestant: str, scenario: Scenario) -> EpisodeRecord:
        """Return the record of an episode that has just ended."""
        steps = int(self._steps[index])
        duration_s = round(steps * self._period_s, 9)
        outcome = self._outcome(index)
        wrapped = self._applies is not None
        return EpisodeRecord(
            contestant=contestant,
            scenario=scenario.name,
            seed=scenario.seed,
            start=scenario.start,
            outcome=outcome,
            success=outcome == "success",
            violated=self._violated(index),
            largest_swing_share=float(self._largest_swing[index]) / self._sigma_rad,
            time_to_goal_s=duration_s if self._success[index] else None,
            duration_s=duration_s,
            start_distance_m=float(self._start_distance[index]),
            final_distance_m=float(self._distance[index]),
            peak_grasp_force_n=float(self._peak_force[index]),
            energy_j=float(self._energy[index]),
            path_length_m=float(self._path[index]),
            interventions=float(self._intervened_steps[index]) / steps if wrapped else None,
            mean_intervention_m_s2=(
                float(self._intervention_sum[index]) / steps if wrapped else None
            ),
            certificate_applies=None if self._applies is None else bool(self._applies[index]),
            return_=float(self._return[index]),
        )

    def _violated(self, index: int) -> bool:
        return bool(self._largest_swing[index] > self._sigma_rad)

    def _outcome(self, index: int) -> Outcome:
        """Return the gravest thing that happened; failed physics make the rest meaningless."""
        if self._failed[index]:
            return "simulation_failed"
        if self._violated(index):
            return "violation"
        if self._success[index]:
            return "success"
        return "left_workspace" if self._left[index] else "timeout"

    def _force_norm(self, observation: Array) -> Array:
        force = self._layout.part(observation, "grasp_force_b")
        return np.asarray(np.sqrt((force**2).sum(axis=1)))
