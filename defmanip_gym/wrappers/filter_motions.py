"""Motions that a storage filter admits, drawn where errors are large: at the edges."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, PITCH_TO_JOINT, ArmKinematics
from defmanip_gym.theory.filters.storage_keeping import StorageKeeping
from defmanip_gym.wrappers.admissible_motions import Motions, about_zero, arm_range, drawn

Array = NDArray[np.float64]

_FASTEST_TURN_RAD_S = 2.5
_FOLLOWED_RAD = 0.5  # angle of a mode in a control period
_EDGE_SHARE = 0.5
_SCALINGS = 40


def resting_states(
    config: TransportConfig, count: int, rng: np.random.Generator, swing_rad: float
) -> Motions:
    """Draw starts: at rest, the object swung up to the largest swing of ``task.start``."""
    swing = config.payload.swung(about_zero(rng, swing_rad, (count,)))
    return Motions(
        joints=drawn(rng, *arm_range(config), (count, 2)),
        joint_rates=np.zeros((count, 2)),
        base_velocity=np.zeros((count, 2)),
        swing=swing,
        swing_rate=np.zeros_like(swing),
    )


def moving_states(
    config: TransportConfig, safety_filter: StorageKeeping, count: int, rng: np.random.Generator
) -> Motions:
    """Draw robots on their way, with objects that store up to the filter's level.

    Grasps are anywhere that the arm reaches with the reach of starts and goal and its elbow bent,
    as fast as they may be in any direction.
    """
    kinematics = ArmKinematics(config.robot)
    reached = kinematics.reach_and_height(np.array(arm_range(config)) @ JOINT_TO_PITCH.T)[:, 0]
    reach = drawn(rng, reached.min(), reached.max(), (count,))
    reach, low, high = _reachable(safety_filter, reach, rng)
    height = drawn(rng, low, high, (count,))
    pitch = _pitch(config, reach, height)
    rising = _vertical_speeds(safety_filter, height - low, high - height, rng)
    rates = np.stack((0.5 * rng.random(count) * (reached.mean() - reach), rising), axis=-1)
    pitch_rate = np.linalg.solve(kinematics.jacobian(pitch), rates[..., None])[..., 0]
    fastest = config.task.max_speed_m_s
    turning = about_zero(rng, _FASTEST_TURN_RAD_S, (count,))
    turning = np.clip(turning, -fastest / reach, fastest / reach)
    left = np.sqrt(np.maximum(fastest**2 - (reach * turning) ** 2 - rising**2, 0.0))
    forward = drawn(rng, -left, left, (count,))
    swing, swing_rate = _stored(safety_filter, turning, count, rng)
    return Motions(
        joints=pitch @ PITCH_TO_JOINT.T,
        joint_rates=np.asarray(pitch_rate @ PITCH_TO_JOINT.T, dtype=np.float64),
        base_velocity=np.stack((forward - rates[:, 0], turning), axis=-1),
        swing=swing,
        swing_rate=swing_rate,
    )


def _reachable(
    safety_filter: StorageKeeping, reach: Array, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Return reaches at which the filter lets the arm be, with lowest and highest grasps, (n,) m.

    Raises:
        CertificateError: there are none.
    """
    low, high = safety_filter.heights(reach)
    possible = np.flatnonzero(low < high)
    if not len(possible):
        raise CertificateError(
            "reach of task.start and task.goal",
            (float(reach.min()), float(reach.max())),
            "one at which the bent arm is above the lowest grasp",
            "Let the robot start and end with its elbow bent, or lower smallest_grasp_height_m.",
        )
    if len(possible) < len(reach):
        chosen = np.where(low < high, np.arange(len(reach)), rng.choice(possible, len(reach)))
        reach, low, high = reach[chosen], low[chosen], high[chosen]
    return reach, low, high


def _pitch(config: TransportConfig, reach: Array, height: Array) -> Array:
    """Return the pitches, (n, 2) rad, of an arm whose elbow points up."""
    upper, fore = config.robot.upper_arm.length_m, config.robot.forearm.length_m
    above = height - config.robot.shoulder_height_m
    square = reach**2 + above**2
    bend = np.arccos(np.clip((square - upper**2 - fore**2) / (2 * upper * fore), -1.0, 1.0))
    first = np.arctan2(above, reach) + np.arctan2(fore * np.sin(bend), upper + fore * np.cos(bend))
    return np.stack((first, first - bend), axis=-1)


def _vertical_speeds(
    safety_filter: StorageKeeping, below: Array, above: Array, rng: np.random.Generator
) -> Array:
    """Draw vertical speeds, (n,) m/s, that can be had and stopped within the arm's range."""
    task = safety_filter.task
    stopping, starting = 2 * safety_filter.braking_m_s2, 2 * task.max_acceleration_m_s2
    rising = np.sqrt(np.minimum(stopping * above, starting * below))
    sinking = np.sqrt(np.minimum(stopping * below, starting * above))
    speeds = drawn(rng, -sinking, rising, below.shape)
    return np.clip(speeds, -task.max_speed_m_s, task.max_speed_m_s)


def _stored(
    safety_filter: StorageKeeping, turning: Array, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draw swings and rates, (n, N) each, that store up to the level, many of them just that.

    Modes that swing faster than a control period can follow start at rest; the commands of the
    search excite them as far as commands do.
    """
    frequencies, modes = safety_filter.modes()
    followed = frequencies * safety_filter.task.control_period_s < _FOLLOWED_RAD
    followed[0] = True
    frequencies, modes = frequencies[followed], modes[:, followed]
    sizes = rng.normal(size=(count, len(frequencies)))
    sizes[rng.random(count) < _EDGE_SHARE, 1:] = 0.0  # the slowest alone, which swings farthest
    phases = 2 * math.pi * rng.random((count, len(frequencies)))
    swing = (sizes * np.cos(phases)) @ modes.T
    rate = (sizes * np.sin(phases) * frequencies) @ modes.T
    wanted = drawn(rng, np.array(0.0), np.array(1.0), (count,))
    factor = np.ones(count)
    for _ in range(_SCALINGS):  # B grows about with the square
        away, moving = factor[:, None] * swing, factor[:, None] * rate
        stored = safety_filter.shares_of(safety_filter.equilibrium + away, moving, turning)
        factor *= np.sqrt(np.maximum(wanted, 1e-6) / np.maximum(stored, 1e-9)).clip(0.5, 2.0)
    return safety_filter.equilibrium + factor[:, None] * swing, factor[:, None] * rate
