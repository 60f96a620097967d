"""Whether a robot can carry its payload at all: its weight, and the loop around its force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import PayloadError
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.theory.dynamics.measured_force import MeasuredForceLinearization
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH
from defmanip_gym.theory.dynamics.task_space import task_inertia

Array = NDArray[np.float64]


def require_carriable(config: TransportConfig) -> None:
    """Raise PayloadError unless the robot holds its payload at start and goal, and stably so.

    Rods are taken as they are: the model of the force loop is theirs, and what they may weigh was
    never asked.
    """
    if config.payload.is_hinged:
        return
    _require_straight(config)
    _require_strength(config)
    if config.control_mode == "task":
        _require_stability(config)


def _arms(config: TransportConfig) -> Array:
    """Return joint angles of the goal and of the starts' corners, (5, 2) rad."""
    start = config.task.start
    center, spread = np.array(start.center[3:5]), np.array(start.spread[3:5])
    corners = center + spread * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
    return np.vstack((np.array(config.task.goal[3:5]), corners))


def _require_straight(config: TransportConfig) -> None:
    """Look at where it hangs: success is counted from its coordinates' zero, and so is σ."""
    rest = max(config.payload.coordinates, key=lambda each: abs(each.rest))
    tolerance = min(config.task.swing_tolerance_rad, config.sigma_rad)
    if abs(rest.rest) >= tolerance:
        raise PayloadError(
            f"equilibrium of {rest.name!r}, {rest.unit}",
            rest.rest,
            f"within task.swing_tolerance_rad and sigma_rad of zero, {tolerance:g}",
            "Build the object as it hangs, or allow more.",
        )


def _require_strength(config: TransportConfig) -> None:
    joints, robot = _arms(config), config.robot
    count = len(joints)
    nothing = np.zeros((count, 3))
    weight = nothing.copy()
    mass_kg = config.payload.mass_kg
    weight[:, 2] = mass_kg * GRAVITY_M_S2
    linearization = MeasuredForceLinearization(
        robot, RedundancyResolution(robot, goal_reach_m=config.goal_reach_and_height_m[0])
    )
    rates, masses = np.zeros((count, 2)), np.zeros(count)
    forces = linearization.generalized_forces(
        nothing, joints, rates, rates, weight, nothing, masses, masses
    )
    shares = np.abs(forces) / np.array(robot.force_limits)
    if shares.max() >= 1.0:
        _, worst = np.unravel_index(int(np.argmax(shares)), shares.shape)
        limit = ("drive force", "steering torque", "shoulder torque", "elbow torque")[int(worst)]
        raise PayloadError(
            "mass of the payload, kg",
            mass_kg,
            f"what the robot holds: this takes {shares.max():.3g} times its largest {limit}",
            "Carry something lighter, or give RobotParams stronger drives.",
        )


def _require_stability(config: TransportConfig) -> None:
    """Look at what is left of an error of acceleration after a sample (docs/derivations.md)."""
    linear = config.payload.linear
    apparent = linear.m_o11 - linear.m_o12 @ np.linalg.solve(linear.m_o22, linear.m_o12.T)
    weighed = np.diag(config.payload.felt_inertia_kg)
    pitch = _arms(config) @ JOINT_TO_PITCH.T
    inertia = task_inertia(config.robot, pitch)
    left = np.linalg.solve(inertia + apparent, np.broadcast_to(apparent - weighed, inertia.shape))
    radius = float(np.abs(np.linalg.eigvals(left)).max())
    if radius >= 1.0:
        raise PayloadError(
            "payload",
            f"an apparent inertia of {np.linalg.eigvalsh(apparent).min():.3g} kg or more",
            f"one with which the force loop is stable (an error grows {radius:.3g} times a sample)",
            "Carry something lighter against the robot's own inertia.",
        )
