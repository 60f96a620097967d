"""A filter for an object from a file, with as much room as its steps on the rig need."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.objects.mjcf_object import MjcfObject
from defmanip_gym.objects.rig_robot import RigRobot
from defmanip_gym.params import RobotParams
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH
from defmanip_gym.theory.filters.object_filter import ObjectConditions, ObjectStorageFilter
from defmanip_gym.theory.filters.safety_filter import BoolArray

_STATES, _ROUNDS = 2048, 4
_TENTH, _SPARE = 1.1, 1.05
_SPEED_SHARE = 0.99  # of the limit


def object_filter_for(
    thing: MjcfObject,
    *,
    sigma_rad: float = math.pi / 6,
    robot: RobotParams = RobotParams(),
    task: TaskParams = TaskParams(),
    conditions: ObjectConditions = ObjectConditions(),
) -> ObjectStorageFilter:
    """Return a filter for an object, with room for what integration leaves unforeseen.

    Args:
        thing: the object.
        sigma_rad: σ.
        robot: that carries it.
        task: its limits and control period.
        conditions: errors of that robot, and delay.

    Raises:
        CertificateError: there is no V_σ, or errors leave nothing of it.
        ObjectFileError: the object has springs that links do not.
    """
    linkage = thing.linkage()
    for _ in range(_ROUNDS):
        made = ObjectStorageFilter(
            linkage,
            mass_kg=thing.object_file.mass_kg,
            sigma_rad=sigma_rad,
            robot=robot,
            task=task,
            conditions=conditions,
        )
        needed = _TENTH * storage_error_on_rig(thing, made)
        if needed <= conditions.storage_error:
            return made
        conditions = replace(conditions, storage_error=_SPARE * needed)
    raise CertificateError(
        "storage_error of the object",
        conditions.storage_error,
        "one that does not grow with the room that is made for it",
        "Use a shorter control period.",
    )


def storage_error_on_rig(thing: MjcfObject, made: ObjectStorageFilter, *, seed: int = 0) -> float:
    """Return how much more of V_σ a period on the rig brought than was foreseen, at most.

    From states whose storage is anything up to the level, at any speed, under wild commands.
    """
    rng = np.random.default_rng(seed)
    robot = RigRobot(ObjectRig(thing.rig(), count=_STATES, num_threads=1), made.setup.limits)
    speed = made.task.max_speed_m_s * np.sqrt(rng.uniform(0, _SPEED_SHARE, _STATES))
    course = rng.uniform(-np.pi, np.pi, _STATES)
    velocity = np.stack((speed * np.cos(course), speed * np.sin(course)), axis=1)
    velocity[:, 1] *= rng.random(_STATES)
    pitch = np.tile(JOINT_TO_PITCH @ np.array(made.task.goal[3:5]), (_STATES, 1))
    nothing = np.zeros((_STATES, made.segment_count))
    rows = robot.place(pitch, nothing, nothing, velocity_b=velocity)
    yaw_rate = robot.layout.part(rows, "base_velocity")[:, 1]
    z2, rate, found = storing(made, rng.uniform(0, 1, _STATES), yaw_rate, rng)
    before = robot.place(pitch, z2, rate, velocity_b=velocity)
    largest = made.task.max_acceleration_m_s2
    commands = largest * rng.choice((-1.0, 1.0), (_STATES, 3))
    after = robot.step(commands, np.zeros((_STATES, 3)))
    return float(made.storage_errors(before, after)[found].max(initial=0.0))


def storing(
    made: ObjectStorageFilter, shares: Array, yaw_rate: Array, rng: np.random.Generator
) -> tuple[Array, Array, BoolArray]:
    """Return z2, ż2 (n, N) that store shares of the level at yaw rates (n,), and where they do."""
    n, N = len(shares), made.segment_count
    ways, rates = rng.normal(size=(2, n, N))
    ends = np.where(ways > 0, made.sigma_rad, -made.sigma_rad) - made.equilibrium
    low, high = np.zeros(n), np.abs(ends / ways).min(axis=1)
    aims = rng.uniform(0, 1, n) * shares  # of which the rest is motion
    rest = np.zeros((n, N))
    for _ in range(30):
        middle = 0.5 * (low + high)
        stored = made.shares_of(made.equilibrium + middle[:, None] * ways, rest, yaw_rate)
        low, high = np.where(stored <= aims, middle, low), np.where(stored <= aims, high, middle)
    z2 = made.equilibrium + low[:, None] * ways
    still, moving = made.shares_of(z2, rest, yaw_rate), made.shares_of(z2, rates, yaw_rate)
    factor = np.sqrt(np.maximum(shares - still, 0.0) / np.maximum(moving - still, 1e-300))
    found: BoolArray = still <= shares
    return z2, factor[:, None] * rates, found
