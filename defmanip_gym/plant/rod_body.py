"""A rod at the end of the arm, whose hinges are relative: z2 are angles from the vertical."""

from __future__ import annotations

from math import cos, sin

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.compiled import compiled
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.beam_body import add_beam
from defmanip_gym.plant.beam_variation import BeamVariation
from defmanip_gym.plant.plant_state import PlantState, read_robot

Array = NDArray[np.float64]


@compiled
def read_rod(
    ids: NDArray[np.intp], position: Array, velocity: Array, force_s: Array, state: PlantState
) -> None:
    """Fill in the state for MuJoCo's qpos and qvel.

    Args:
        ids: the simulations to read.
        position: x, y, θ and the hinges' relative angles, (n, 5 + N).
        velocity: their rates, (n, 5 + N).
        force_s: on the object at the grasp, (n, 3) N in the frame of the first segment.
        state: to be filled in.
    """
    _, segments = state.swing.shape
    for row in range(len(ids)):
        i = ids[row]
        read_robot(i, position, velocity, state)
        pitch, pitch_rate = position[i, 3] + position[i, 4], velocity[i, 3] + velocity[i, 4]
        for k in range(segments):
            pitch, pitch_rate = pitch + position[i, 5 + k], pitch_rate + velocity[i, 5 + k]
            state.swing[i, k], state.swing_rate[i, k] = pitch, pitch_rate
        # the first segment's frame is the base's, pitched by its swing
        c, s = cos(state.swing[i, 0]), sin(state.swing[i, 0])
        state.grasp_force_b[i, 0] = c * force_s[i, 0] - s * force_s[i, 2]
        state.grasp_force_b[i, 1] = force_s[i, 1]
        state.grasp_force_b[i, 2] = s * force_s[i, 0] + c * force_s[i, 2]


@compiled
def sense_rod(ids: NDArray[np.intp], position: Array, force_b: Array, force_s: Array) -> None:
    """Write forces in the base frame, (k, 3) N, as the sensor of the first segment has them."""
    for row in range(len(ids)):
        i = ids[row]
        swing = position[i, 3] + position[i, 4] + position[i, 5]
        c, s = cos(swing), sin(swing)
        force_s[i, 0] = c * force_b[row, 0] + s * force_b[row, 2]
        force_s[i, 1] = force_b[row, 1]
        force_s[i, 2] = c * force_b[row, 2] - s * force_b[row, 0]


class RodBody:
    """Hangs a beam from the arm by a hinge.

    Args:
        beam: its parameters.
    """

    def __init__(self, beam: BeamParams) -> None:
        self.read, self.sense = read_rod, sense_rod
        self.beam = beam
        self.count = beam.segment_count

    def attach(
        self, spec: mujoco.MjSpec, forearm: mujoco.MjsBody, robot: RobotParams
    ) -> mujoco.MjsBody:
        """Hang it from the forearm's end and return its first segment."""
        return add_beam(
            spec,
            forearm,
            self.beam,
            position_m=[robot.forearm.length_m, 0.0, 0.0],
            pitch_joints=(names.SHOULDER, names.ELBOW),
        )

    def positions(self, joints: Array, z2: Array) -> Array:
        """Return the hinges' angles: each turns relative to its parent, (k, N)."""
        pitch = np.concatenate((joints[:, :1] + joints[:, 1:], z2), axis=1)
        relative: Array = pitch[:, 1:] - pitch[:, :-1]
        return relative

    def geoms(self, model: mujoco.MjModel) -> list[int]:
        """Return the segments' geoms."""
        return [model.geom(names.segment_geom(k)).id for k in range(self.count)]

    def variation(self, plant: batch.Batch) -> BeamVariation:
        """Return what gives simulations beams of their own."""
        return BeamVariation(plant, self.beam)
