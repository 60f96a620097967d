"""The plant's state in the theory's coordinates, read out of MuJoCo's."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable

Array = NDArray[np.float64]


class PlantState(NamedTuple):
    """What the plant's sensors and encoders see; n simulations, N internal coordinates.

    Attributes:
        base_pose: (x, y, θ), (n, 3) m, m, rad, world frame.
        base_velocity: (u1, u2), (n, 2) m/s, rad/s.
        lateral_speed: slip of the base to its left, (n,) m/s.
        joints: q_a, (n, 2) rad.
        joint_rates: q̇_a, (n, 2) rad/s.
        swing: z2, (n, N): of rods φ in rad from the vertical.
        swing_rate: ż2, (n, N).
        grasp_force_b: force on the object at the grasp, (n, 3) N, base frame.
    """

    base_pose: Array
    base_velocity: Array
    lateral_speed: Array
    joints: Array
    joint_rates: Array
    swing: Array
    swing_rate: Array
    grasp_force_b: Array

    @classmethod
    def empty(cls, count: int, segments: int) -> PlantState:
        """Return a state of n simulations yet to be filled in."""
        return cls(
            base_pose=np.empty((count, 3)),
            base_velocity=np.empty((count, 2)),
            lateral_speed=np.empty(count),
            joints=np.empty((count, 2)),
            joint_rates=np.empty((count, 2)),
            swing=np.empty((count, segments)),
            swing_rate=np.empty((count, segments)),
            grasp_force_b=np.empty((count, 3)),
        )

    def copy(self) -> PlantState:
        """Return a state that keeps its values."""
        return PlantState(*(values.copy() for values in self))

    def freeze(self, failed: NDArray[np.bool_], before: PlantState) -> None:
        """Let simulations that failed, (n,), stay as they last were: finite and meaningful."""
        for values, last in zip(self, before, strict=True):
            values[failed] = last[failed]


@compilable
def read_robot(i: int, position: Array, velocity: Array, state: PlantState) -> None:
    """Fill in base and arm of simulation i from the first five of qpos and qvel, (n, ...)."""
    heading = position[i, 2]
    c, s = cos(heading), sin(heading)
    for k in range(3):
        state.base_pose[i, k] = position[i, k]
    state.base_velocity[i, 0] = c * velocity[i, 0] + s * velocity[i, 1]
    state.base_velocity[i, 1] = velocity[i, 2]
    state.lateral_speed[i] = c * velocity[i, 1] - s * velocity[i, 0]
    for k in range(2):
        state.joints[i, k] = position[i, 3 + k]
        state.joint_rates[i, k] = velocity[i, 3 + k]
