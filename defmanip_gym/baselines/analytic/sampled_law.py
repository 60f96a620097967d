"""What the controllers of the ladder have in common: a law with a memory, behind ``predict``.

A law turns a sample of grasp and object into the acceleration u_o that it wants of the grasp. The
disturbance observer then takes off what the grasp does beside what it is asked for: the laws
themselves know neither a wrong weight nor a push.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.grasp_sample import GraspSample, grasp_sample
from defmanip_gym.baselines.analytic.law_params import LawParams
from defmanip_gym.baselines.controller import State
from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.payloads.payload import Payload
from defmanip_gym.payloads.rod import rod_of
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.disturbance_observer import (
    DisturbanceObserver,
    ObserverMemory,
    weight_disturbance,
)
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import plain, require_params

Array = NDArray[np.float64]
Memory = tuple[NDArray[Any], ...]


class SampledLaw(ABC):
    """A control law for any number of episodes at a time; it keeps nothing of them itself.

    Args:
        payload: the object as the law knows it.
        robot: the robot as the law knows it.
        task: goal, limits and control period.
        params: design choices.
    """

    params: LawParams

    def __init__(
        self,
        *,
        payload: Payload,
        robot: RobotParams | None,
        task: TaskParams | None,
        params: LawParams,
    ) -> None:
        self.params = params
        self.payload = payload
        self.robot = RobotParams() if robot is None else require_params("robot", robot, RobotParams)
        self.task = TaskParams() if task is None else require_params("task", task, TaskParams)
        self.layout = ObservationLayout(payload.count)
        self.kinematics = ArmKinematics(self.robot)
        goal_pitch = JOINT_TO_PITCH @ np.array(self.task.goal[3:5])
        self.goal_reach_m = float(self.kinematics.reach_and_height(goal_pitch)[0])
        self.observer = DisturbanceObserver(
            gain=params.observer_gain_per_s,
            period_s=self.task.control_period_s,
            w_limit=self.task.max_acceleration_m_s2,
            max_speed_m_s=self.task.max_speed_m_s,
        )

    @property
    def beam(self) -> BeamParams:
        """The rod as the law knows it.

        Raises:
            PayloadError: the object is another one.
        """
        return rod_of(self.payload).beam

    @property
    def inner_loop(self) -> InnerLoopKind:
        """The inner loop that the environment is to have."""
        return self.params.inner_loop

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        parts = {"params": self.params, "robot": self.robot, "task": self.task}
        return {name: plain(part) for name, part in parts.items()} | self.payload.known

    @abstractmethod
    def begin(self, now: GraspSample) -> Memory:
        """Return what n episodes that begin remember, arrays (n, ...)."""

    @abstractmethod
    def command(self, now: GraspSample, memory: Memory) -> tuple[Array, Memory]:
        """Return u_o, (n, 3) m/s² in the base frame, and what to remember."""

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return w / a_max and the memory: the observer's three arrays, then the law's."""
        batch = np.atleast_2d(observation)
        now = grasp_sample(batch, self.layout, self.kinematics)
        if state is None:
            estimate, memory = self._first(batch, now)
        else:
            observed = ObserverMemory(estimate=state[0], w=state[1], velocity=state[2])
            estimate = self.observer.updated(observed, now.velocity_b, now.heading, now.yaw_rate)
            memory = state[3:]
            if episode_start is not None and np.any(episode_start):
                first, fresh = self._first(batch, now)
                estimate = _restarted(estimate, first, episode_start)
                pairs = zip(memory, fresh, strict=True)
                memory = tuple(_restarted(old, new, episode_start) for old, new in pairs)
        u_o, memory = self.command(now, memory)
        after = self.observer.command(u_o, estimate, now.velocity_b, now.heading)
        action = after.w / self.task.max_acceleration_m_s2
        following = (after.estimate, after.w, after.velocity, *memory)
        return action.reshape(*observation.shape[:-1], 3), following

    def _first(self, batch: Array, now: GraspSample) -> tuple[Array, Memory]:
        """Return the first estimate, (n, 3) m/s², and memory.

        An inner loop that believes a weight errs by what the force says that it is not.
        """
        if self.inner_loop == "measured_force":
            return np.zeros_like(now.velocity_b), self.begin(now)
        pitch = self.layout.part(batch, "joints") @ JOINT_TO_PITCH.T
        return weight_disturbance(self.robot, self.beam, pitch, now.force_b), self.begin(now)


def _restarted(going: NDArray[Any], fresh: NDArray[Any], starts: NDArray[np.bool_]) -> NDArray[Any]:
    """Return an array (n, ...) that goes on, and the fresh one of episodes that start, (n,)."""
    shape = (-1, *np.ones(fresh.ndim - 1, dtype=int))
    return np.where(np.atleast_1d(starts).reshape(shape), fresh, going)
