"""What happened in the episodes of a batch, sample by sample; records and traces come from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.engine import TransportEngine

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Course:
    """One episode of K control periods; the moments include start and end, K + 1 samples.

    Attributes:
        observation: what the controller saw, (K + 1, size).
        margin_rad: σ − ‖z2‖∞, (K + 1,).
        cost: 1 where σ is exceeded, else 0, (K + 1,).
        distance_m: grasp to goal, (K + 1,).
        base_pose: (x, y, θ), world frame, (K + 1, 3).
        swing_rad: φ of each segment without the sensors' noise, (K + 1, N).
        swing_rate_rad_s: φ̇, (K + 1, N).
        requested: the controller's action, clipped to [-1, 1], (K, 3).
        applied: the one that took effect, after certificate and delay, (K, 3).
        reward: (K,).
        intervened: whether the filter changed the action, (K,); None without filter.
        intervention_m_s2: by how much, (K,); None without filter.
        forward_correction_m_s2: what it added to the forward command, (K,); None without filter.
        certificate_applies: whether it covered the episode to its end; None without filter.
        reached_goal: whether the last moment is a success.
        left_workspace: whether it is outside of the workspace.
        simulation_failed: whether the simulation diverged.
        terminated: whether it ended by what happened in it; if not, its time was over.
    """

    observation: Array
    margin_rad: Array
    cost: Array
    distance_m: Array
    base_pose: Array
    swing_rad: Array
    swing_rate_rad_s: Array
    requested: Array
    applied: Array
    reward: Array
    intervened: Array | None
    intervention_m_s2: Array | None
    forward_correction_m_s2: Array | None
    certificate_applies: bool | None
    reached_goal: bool
    left_workspace: bool
    simulation_failed: bool
    terminated: bool


class CourseRecorder:
    """Collects the courses of n episodes that start together.

    Args:
        engine: of the episodes, just reset.
        observation: of the reset, (n, size).
        info: of the reset.
        largest_step_count: control periods until every episode has ended.
    """

    def __init__(
        self,
        engine: TransportEngine,
        observation: Array,
        info: dict[str, Any],
        largest_step_count: int,
    ) -> None:
        count, size = observation.shape
        segments = engine.config.beam.segment_count
        periods, moments = (count, largest_step_count), (count, largest_step_count + 1)
        self._engine, self._steps = engine, 0
        # episode first, so that an episode's samples lie together; pages are taken when written
        self._moments = {
            "observation": np.empty((*moments, size)),
            "margin_rad": np.empty(moments),
            "cost": np.empty(moments),
            "distance_m": np.empty(moments),
            "base_pose": np.empty((*moments, 3)),
            "swing_rad": np.empty((*moments, segments)),
            "swing_rate_rad_s": np.empty((*moments, segments)),
        }
        self._periods = {
            "requested": np.empty((*periods, 3)),
            "applied": np.empty((*periods, 3)),
            "reward": np.empty(periods),
        }
        applies: BoolArray | None = info.get("filter_applies")
        self._applies = None if applies is None else applies.copy()
        if self._applies is not None:
            self._periods |= {name: np.empty(periods) for name in _INTERVENTIONS}
        self._ends = {name: np.zeros(count, dtype=bool) for name in _END_FLAGS}
        self._terminated = np.zeros(count, dtype=bool)
        self._lengths = np.zeros(count, dtype=np.int64)
        self._keep_moment(observation, info)

    def add(
        self,
        running: BoolArray,
        requested: Array,
        applied: Array,
        observation: Array,
        reward: Array,
        terminated: BoolArray,
        info: dict[str, Any],
    ) -> None:
        """Keep one control period and the moment at its end.

        Args:
            running: the episodes that had not ended before it, (n,).
            requested: the controller's actions, (n, 3).
            applied: those that took effect, (n, 3).
            observation: at its end, (n, size).
            reward: (n,).
            terminated: (n,).
            info: at its end.
        """
        values = {"requested": requested, "applied": applied, "reward": reward, **info}
        if self._applies is not None:
            change = info["applied_action"] - info["wished_action"]
            limit = self._engine.config.task.max_acceleration_m_s2
            values["forward_correction_m_s2"] = limit * change[:, 0]
        for name, kept in self._periods.items():
            kept[:, self._steps] = values[_INTERVENTIONS.get(name, name)]
        self._steps += 1
        self._lengths[running] = self._steps
        self._terminated[running] = terminated[running]
        if self._applies is not None:
            self._applies[running] = info["filter_applies"][running]
        for name, key in _END_FLAGS.items():
            self._ends[name][running] = info[key][running]
        self._keep_moment(observation, info)

    def course(self, index: int) -> Course:
        """Return what happened in an episode, as views."""
        length = int(self._lengths[index])
        moments = {name: kept[index, : length + 1] for name, kept in self._moments.items()}
        periods = {name: kept[index, :length] for name, kept in self._periods.items()}
        ends = {name: bool(flags[index]) for name, flags in self._ends.items()}
        values: dict[str, Any] = dict.fromkeys(_INTERVENTIONS)
        values |= moments | periods | ends
        applies = None if self._applies is None else bool(self._applies[index])
        terminated = bool(self._terminated[index])
        return Course(**values, certificate_applies=applies, terminated=terminated)

    def _keep_moment(self, observation: Array, info: dict[str, Any]) -> None:
        plant, k = self._engine.plant_state, self._steps
        self._moments["observation"][:, k] = observation
        self._moments["margin_rad"][:, k] = info["constraint_margin"]
        self._moments["cost"][:, k] = info["cost"]
        self._moments["distance_m"][:, k] = info["distance_to_goal"]
        self._moments["base_pose"][:, k] = plant.base_pose
        self._moments["swing_rad"][:, k] = plant.swing
        self._moments["swing_rate_rad_s"][:, k] = plant.swing_rate


# by their names in info, or in what is made of it, inside a safety filter only
_INTERVENTIONS = {
    "intervened": "intervened",
    "intervention_m_s2": "correction_m_s2",
    "forward_correction_m_s2": "forward_correction_m_s2",
}
_END_FLAGS = {
    "reached_goal": "is_success",
    "left_workspace": "left_workspace",
    "simulation_failed": "simulation_failed",
}
