"""Motions that a certificate admits, drawn where errors are large: at the edges."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.impulse_response import peak_free_response, peak_gains
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, PITCH_TO_JOINT, ArmKinematics
from defmanip_gym.theory.payload.zero_dynamics import LinearizedObject, linearize

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_EDGE_SHARE = 0.5  # of the draws of a number, at one of its ends


@dataclass(frozen=True, kw_only=True)
class Motions:
    """States of n robots with their beams, straight ahead in the world.

    Attributes:
        joints: q_a, (n, 2) rad.
        joint_rates: q̇_a, (n, 2) rad/s.
        base_velocity: (u1, u2), (n, 2) m/s, rad/s.
        swing: φ, (n, N) rad.
        swing_rate: φ̇, (n, N) rad/s.
    """

    joints: Array
    joint_rates: Array
    base_velocity: Array
    swing: Array
    swing_rate: Array


def arm_range(config: TransportConfig) -> tuple[Array, Array]:
    """Return the lowest and the highest joint angles, (2,) rad, of starts and goal."""
    start, goal = config.task.start, np.array(config.task.goal[3:5])
    center, spread = np.array(start.center[3:5]), np.array(start.spread[3:5])
    return np.minimum(center - spread, goal), np.maximum(center + spread, goal)


def resting_motions(
    config: TransportConfig, certificate: Certificate, count: int, rng: np.random.Generator
) -> Motions:
    """Draw starts: at rest, the beam straight and within the certificate's initial swing."""
    segments = config.beam.segment_count
    lowest, highest = arm_range(config)
    swing = about_zero(rng, certificate.conditions.initial_swing_rad, (count, 1))
    return Motions(
        joints=drawn(rng, lowest, highest, (count, 2)),
        joint_rates=np.zeros((count, 2)),
        base_velocity=np.zeros((count, 2)),
        swing=np.repeat(swing, segments, axis=1),
        swing_rate=np.zeros((count, segments)),
    )


def moving_motions(
    config: TransportConfig, certificate: Certificate, count: int, rng: np.random.Generator
) -> Motions:
    """Draw motions on the way from starts to goal.

    The arm is within ``arm_range``; its reach goes to that of the goal as the redundancy resolution
    has it, and the grasp lifts as fast as the vertical acceleration allows over the arm's length.
    """
    kinematics = ArmKinematics(config.robot)
    joints = drawn(rng, *arm_range(config), (count, 2))
    pitch = joints @ JOINT_TO_PITCH.T
    reach = kinematics.reach_and_height(pitch)[:, 0]
    lifting = _fastest_lift(config, certificate)
    rates = np.stack(
        (
            0.5 * rng.random(count) * (config.goal_reach_and_height_m[0] - reach),
            about_zero(rng, lifting, (count,)),
        ),
        axis=-1,
    )
    pitch_rate = np.linalg.solve(kinematics.jacobian(pitch), rates[..., None])[..., 0]
    forward = about_zero(rng, config.task.max_speed_m_s, (count,))
    swing, swing_rate = _swings(config, certificate, count, rng)
    return Motions(
        joints=joints,
        joint_rates=np.asarray(pitch_rate @ PITCH_TO_JOINT.T, dtype=np.float64),
        base_velocity=np.stack(
            (
                forward - rates[:, 0],
                about_zero(rng, certificate.commanded_yaw_rate_rad_s, (count,)),
            ),
            axis=-1,
        ),
        swing=swing,
        swing_rate=swing_rate,
    )


def _fastest_lift(config: TransportConfig, certificate: Certificate) -> float:
    acceleration = certificate.conditions.vertical_acceleration_m_s2
    kinematics = ArmKinematics(config.robot)
    heights = kinematics.reach_and_height(np.array(arm_range(config)) @ JOINT_TO_PITCH.T)[:, 1]
    goal_height = config.goal_reach_and_height_m[1]
    way_m = float(np.abs(heights - goal_height).max())
    return min(math.sqrt(2 * acceleration * way_m), config.task.max_speed_m_s)


def _swings(
    config: TransportConfig, certificate: Certificate, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draw z2 and ż2, many at the edge of what the certified acceleration reaches, (n, N) each.

    Sums of the linear object's modes in any phase, as large as the peaks of each mode, of angles
    and of rates allow. What lifting and turning add, and the linear model lacks, they add to the
    certified object up to σ, and to this one in proportion.
    """
    linear = linearize(config.beam)
    peaks, modal_peaks, modes = _reach(linear, certificate)
    certified = certificate.deformable
    certified = linearize(certified) if isinstance(certified, BeamParams) else certified
    certified_peaks, _, _ = _reach(
        certified.scaled(damping=certificate.intervals.damping[0]), certificate
    )
    growth = max(certificate.sigma_rad / float(certified_peaks[: linear.count].max()), 1.0)
    shape = (count, 2 * linear.count)
    phases = np.exp(2j * np.pi * rng.random(shape))
    state = ((drawn(rng, 0.0 * modal_peaks, modal_peaks, shape) * phases) @ modes.T).real
    share = (np.abs(state) / peaks).max(axis=1, keepdims=True)
    state *= growth / np.maximum(share, 1.0)
    return state[:, : linear.count], state[:, linear.count :]


def _reach(linear: LinearizedObject, certificate: Certificate) -> tuple[Array, Array, ComplexArray]:
    """Return the peaks of η = (z2, ż2) and of its modes, (2N,) each, and the modes, (2N, 2N)."""
    A, b, states = linear.A_u, linear.forward_input[:, None], np.eye(2 * linear.count)
    acceleration = certificate.resulting_acceleration
    start = np.zeros((2 * linear.count, 1))
    start[: linear.count] = certificate.conditions.initial_swing_rad
    peaks = peak_gains(A, b, states)[:, 0] * acceleration
    peaks += peak_free_response(A, start, states)
    eigenvalues, modes = np.linalg.eig(A)
    into_modes = np.linalg.inv(modes)
    modal_peaks = np.abs(into_modes @ b)[:, 0] / -eigenvalues.real * acceleration
    return peaks, modal_peaks + np.abs(into_modes @ start)[:, 0], modes


def drawn(rng: np.random.Generator, lowest: Array, highest: Array, shape: tuple[int, ...]) -> Array:
    """Draw numbers of a shape from [lowest, highest], half of them ends."""
    share = rng.random(shape)
    share = np.where(rng.random(shape) < _EDGE_SHARE, np.round(share), share)
    values: Array = lowest + share * (highest - lowest)
    return values


def about_zero(rng: np.random.Generator, size: float, shape: tuple[int, ...]) -> Array:
    """Draw numbers of a shape from [-size, size], half of them ends."""
    return drawn(rng, np.array(-size), np.array(size), shape)
