"""One instant of n episodes: the true state, what the task makes of it, what sensors report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs import task as transport
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.observation import NEAR_OFFSET_SCALE_M, ObservationLayout
from defmanip_gym.params import DisturbanceParams
from defmanip_gym.plant.simulation import PlantState
from defmanip_gym.theory.frames import base_to_world, world_to_base
from defmanip_gym.theory.robot_model import JOINT_TO_PITCH, ArmKinematics

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """The true state of n episodes at one instant.

    Attributes:
        plant: joints, velocities, swing and grasp force.
        grasp_velocity_b: (n, 3) m/s, base frame.
        goal_offset_b: goal minus grasp position, (n, 3) m, base frame.
        task: what success, cost and reward look at.
    """

    plant: PlantState
    grasp_velocity_b: Array
    goal_offset_b: Array
    task: transport.TaskState


class Surveyor:
    """Relates plant states to the goal.

    Args:
        config: geometry and goal.
    """

    def __init__(self, config: TransportConfig) -> None:
        self._kinematics = ArmKinematics(config.robot)
        self._goal_position = np.array(config.goal_position_m)
        self._task = config.task

    def snapshot(self, plant: PlantState) -> Snapshot:
        """Return the snapshot of a plant state."""
        pitch, pitch_rate = plant.joints @ JOINT_TO_PITCH.T, plant.joint_rates @ JOINT_TO_PITCH.T
        reach_and_height = self._kinematics.reach_and_height(pitch)
        rates = (self._kinematics.jacobian(pitch) * pitch_rate[:, None, :]).sum(-1)
        reach, u1, u2 = reach_and_height[:, 0], plant.base_velocity[:, 0], plant.base_velocity[:, 1]
        velocity = np.stack((u1 + rates[:, 0], reach * u2, rates[:, 1]), axis=1)
        heading, offset = plant.base_pose[:, 2], np.empty_like(velocity)
        offset[:, :2] = self._goal_position[:2] - plant.base_pose[:, :2]
        offset[:, 2] = self._goal_position[2] - reach_and_height[:, 1]
        offset = world_to_base(offset, heading)
        offset[:, 0] -= reach
        heading_error = transport.wrapped(heading - self._task.goal[2])
        position = -base_to_world(offset, heading_error)[:, :2]
        state = transport.TaskState(
            distance_m=np.sqrt((offset**2).sum(axis=1)),
            height_error_m=offset[:, 2],
            speed_m_s=np.sqrt((velocity**2).sum(axis=1)),
            heading_error_rad=heading_error,
            course_error_rad=transport.course_error(
                position, heading_error, self._task.course_blend_radius_m
            ),
            largest_swing_rad=np.abs(plant.swing).max(axis=1),
        )
        return Snapshot(plant=plant, grasp_velocity_b=velocity, goal_offset_b=offset, task=state)


def clean_observation(now: Snapshot) -> Array:
    """Return the observation without sensor noise, (n, size), in the order of its layout."""
    plant, error = now.plant, now.task.heading_error_rad
    return np.concatenate(
        (
            now.goal_offset_b,
            np.sin(error)[:, None],
            np.cos(error)[:, None],
            now.grasp_velocity_b,
            plant.base_velocity,
            plant.joints,
            plant.joint_rates,
            plant.swing,
            plant.swing_rate,
            plant.grasp_force_b,
            np.tanh(now.goal_offset_b / NEAR_OFFSET_SCALE_M),
        ),
        axis=1,
    )


def add_sensor_noise(
    observation: Array,
    layout: ObservationLayout,
    disturbance: DisturbanceParams,
    generators: Sequence[np.random.Generator],
    ids: NDArray[np.intp],
) -> None:
    """Add each episode's own noise to the rows ``ids`` of the observations, in place."""
    for name, deviation in (
        ("grasp_force_b", disturbance.force_sensor_noise_n),
        ("swing", disturbance.swing_sensor_noise_rad),
    ):
        if deviation > 0:
            part = layout.part(observation, name)
            for index in ids:
                part[index] += generators[index].normal(0.0, deviation, part.shape[1])


def frozen(plant: PlantState, before: PlantState, kept: NDArray[np.bool_]) -> PlantState:
    """Return a plant state in which the simulations ``kept`` (n,) are as they were before."""
    changes = {}
    for name in PlantState.__dataclass_fields__:
        value = getattr(plant, name).copy()
        value[kept] = getattr(before, name)[kept]
        changes[name] = value
    return replace(plant, **changes)
