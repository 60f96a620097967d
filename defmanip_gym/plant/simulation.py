"""Batched physics with read-outs in the theory's coordinates."""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import cos, sin
from typing import Any

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from defmanip_gym.compiled import compiled, machine_code
from defmanip_gym.params import RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.builder import build_model
from defmanip_gym.plant.divergence import DivergenceSentinel
from defmanip_gym.plant.forks import new_batch
from defmanip_gym.plant.payload_body import PayloadBody
from defmanip_gym.plant.plant_state import PlantState

Array = NDArray[np.float64]


# MuJoCo takes states for diverged beyond 1e10 only; no robot moves at 1e4 m/s or rad/s
_FASTEST = 1e4


class Simulation:
    """n copies of the plant, stepped together on a thread pool.

    Args:
        robot: true robot parameters.
        body: what it truly carries.
        count: number of simulations n.
        goal_position_m: where the goal marker stands, world frame.
        physics_period_s: integration step.
        num_threads: 0 for one per CPU.
    """

    def __init__(
        self,
        robot: RobotParams,
        body: PayloadBody,
        *,
        count: int,
        goal_position_m: tuple[float, float, float],
        physics_period_s: float,
        num_threads: int = 0,
    ) -> None:
        self.model = build_model(
            robot, body, goal_position_m=goal_position_m, physics_period_s=physics_period_s
        )
        self.count = count
        self._threads = min(count, num_threads or os.cpu_count() or 1)
        self._bind(new_batch(self.model, count, self._threads))
        self._pristine = self._batch.state[0].copy()
        self.body, self._variation = body, body.variation(self._batch)
        self._grasp_force_s = np.zeros((count, 3))
        self._readings = np.zeros((count, 1, 3))
        self._forearm = self.model.body(names.FOREARM).id
        self._forearm_com_m = float(self.model.body(names.FOREARM).ipos[0])
        self._forearm_length_m = robot.forearm.length_m
        self._period_s = float(physics_period_s)
        self._all = np.arange(count)
        self._read = machine_code(
            body.read,
            self._all,
            self._position,
            self._velocity,
            self._grasp_force_s,
            PlantState.empty(count, body.count),
        )
        self._lead = machine_code(
            _lead_no_slip, self._position, self._velocity, self._period_s, self._lateral_target
        )
        self._sense = machine_code(
            body.sense, self._all, self._position, np.empty((1, 3)), self._grasp_force_s
        )
        self._conclude = machine_code(
            _conclude,
            self._readings,
            self._velocity,
            self._grasp_force_s,
            self._sentinel.counter,
            np.zeros(count, dtype=np.bool_),
        )

    def _bind(self, plant: batch.Batch) -> None:
        """Look at the fields of a batch from now on."""
        self._batch, self._process = plant, os.getpid()
        self._position: Array = plant.bind("qpos")
        self._velocity: Array = plant.bind("qvel")
        control: Array = plant.bind("ctrl")
        self._control = control[:, : len(names.ACTUATORS)]
        self._lateral_target = control[:, self.model.actuator(names.NO_SLIP).id]
        self._external: Array = plant.bind("xfrc_applied")
        self._sensed_force: Array = plant.bind("sensordata")
        self._sentinel = DivergenceSentinel(plant)

    def _require_threads(self) -> None:
        """Make the batch anew in a forked child, which has none of the threads that step it."""
        if self._process == os.getpid():
            return
        state = self.get_state()
        self._bind(new_batch(self.model, self.count, self._threads))
        self._variation.move_to(self._batch)
        self.set_state(state)

    def get_state(self) -> dict[str, Any]:
        """Return what the simulations' future depends on beside their beams, arrays (n, ...)."""
        return {
            "physics": self._batch.state.copy(),
            "warnings": self._sentinel.counters.copy(),
            "grasp_force_s": self._grasp_force_s.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned for simulations of the same beams."""
        self._batch.state[:] = state["physics"]
        self._sentinel.counters[:] = state["warnings"]
        self._grasp_force_s[:] = state["grasp_force_s"]

    def read(self) -> PlantState:
        """Return the current state and the grasp force at this instant."""
        state = PlantState.empty(self.count, self.body.count)
        self.read_into(state, self._all)
        return state

    def read_into(self, state: PlantState, ids: NDArray[np.intp]) -> None:
        """Fill in the rows ``ids`` of a state of n simulations."""
        self._read(ids, self._position, self._velocity, self._grasp_force_s, state)

    def carry(self, ids: NDArray[np.intp], things: Sequence[Any]) -> None:
        """Let simulations carry others than the given one; place them afterwards.

        Raises:
            ParameterError: others than its body lets differ.
        """
        self._require_threads()
        self._variation.set(ids, things)

    def place(self, ids: NDArray[np.intp], pose: Array, joints: Array, swing: Array) -> None:
        """Put simulations at rest: ``pose`` (k, 3), ``joints`` (k, 2), ``swing`` (k, N) for z2."""
        self._batch.state[ids] = self._pristine  # what Batch.reset does, at a fraction of its cost
        self._sentinel.arm(ids)
        held = self.body.positions(joints, swing)
        self._position[ids] = np.concatenate((pose, joints, held), axis=1)

    def move(
        self,
        ids: NDArray[np.intp],
        base_velocity: Array,
        joint_rates: Array,
        swing_rate: Array,
    ) -> None:
        """Set simulations in motion: (u1, u2) (k, 2), q̇_a (k, 2), φ̇ (k, N)."""
        heading = self._position[ids, 2]
        self._velocity[ids] = np.column_stack(
            (
                np.cos(heading) * base_velocity[:, 0],
                np.sin(heading) * base_velocity[:, 0],
                base_velocity[:, 1],
                joint_rates,
                self.body.positions(joint_rates, swing_rate),
            )
        )

    def report(self, ids: NDArray[np.intp], grasp_force_b: Array) -> None:
        """Let ``read`` report a known grasp force, (k, 3) N, until the next step."""
        self._sense(ids, self._position, grasp_force_b, self._grasp_force_s)

    def hold(self, ids: NDArray[np.intp], generalized_forces: Array) -> None:
        """Set T_r of simulations, (k, 4), and compute the forces it causes, without stepping."""
        self._require_threads()
        self._control[ids] = generalized_forces
        self._batch.forward(ids)
        self._grasp_force_s[ids] = self._sensed_force[ids]

    @property
    def generalized_forces(self) -> Array:
        """T_r = (f_b, α_b, τ1, τ2), (n, 4), to be written; the actuator limits clip it."""
        return self._control

    def apply(self, generalized_forces: Array) -> None:
        """Set T_r, (n, 4)."""
        self._control[:] = generalized_forces

    def push_grasp(self, force_b: Array) -> None:
        """Let a force act on the end effector, (n, 3) N in the base frame, until set anew."""
        arm = self._forearm_length_m - self._forearm_com_m
        _push(self._position, force_b, arm, self._external[:, self._forearm])

    def step(self, substeps: int) -> NDArray[np.bool_]:
        """Advance all simulations; return which of them diverged, (n,).

        A simulation that diverged holds a meaningless state until it is placed again.
        """
        self._require_threads()
        self._lead(self._position, self._velocity, self._period_s, self._lateral_target)
        if self._readings.shape[1] != substeps:
            self._readings = np.empty((self.count, substeps, 3))
        erring: NDArray[np.intp] | tuple[()] = ()
        try:
            self._batch.rollout(
                substeps, record=("sensordata",), out={"sensordata": self._readings}
            )
            if substeps == 1:  # a single reading has no slope
                self._batch.forward()
        except batch.SimulationError as error:
            erring = error.ids
        failed = np.empty(self.count, dtype=np.bool_)
        self._conclude(
            self._readings, self._velocity, self._grasp_force_s, self._sentinel.counter, failed
        )
        if len(erring):
            failed[erring] = True
        if substeps == 1:
            self._grasp_force_s[:] = self._sensed_force
        return failed

    def materialize(self, index: int, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Write one simulation's beam and state into a copy of the model and its data, to draw."""
        self._variation.write_to(model, index)
        self._batch.get_data(index, data)
        mujoco.mj_forward(model, data)


@compiled
def _lead_no_slip(position: Array, velocity: Array, period_s: float, target: Array) -> None:
    """Set the lateral velocity that the no-slip force is to reach.

    It acts along the axle at the start of a step, and the base has turned by u2 h at its end:
    without this lead it would slip by u1 u2 h, 5 mm/s at 1 m/s and 1 rad/s.
    """
    for i in range(len(target)):
        heading = position[i, 2]
        forward = cos(heading) * velocity[i, 0] + sin(heading) * velocity[i, 1]
        target[i] = forward * velocity[i, 2] * period_s


@compiled
def _conclude(
    readings: Array,
    velocity: Array,
    force: Array,
    sentinel: NDArray[np.int32],
    failed: NDArray[np.bool_],
) -> None:
    """Extrapolate the force to this instant, and mark the simulations that diverged.

    The sensor lags the state by one substep, which the force loop would take for damping, and a
    forward pass after each period would cost a fifth of the physics. The last two readings, under
    the same controls, give the force of this instant to O(h²).
    """
    _, substeps, _ = readings.shape
    _, size = velocity.shape
    last = substeps - 1
    previous = last - 1 if last > 0 else 0
    for i in range(len(force)):
        for k in range(3):
            force[i, k] = 2 * readings[i, last, k] - readings[i, previous, k]
        for k in range(size):
            if not abs(velocity[i, k]) < _FASTEST:
                sentinel[i] = 0
        failed[i] = sentinel[i] == 0


@compiled
def _push(position: Array, force_b: Array, arm_m: float, wrench: Array) -> None:
    """Write force and torque about the forearm's centre of mass, world frame, (n, 6)."""
    for i in range(len(wrench)):
        heading, pitch = position[i, 2], position[i, 3] + position[i, 4]
        c, s = cos(heading), sin(heading)
        x, y = c * force_b[i, 0] - s * force_b[i, 1], s * force_b[i, 0] + c * force_b[i, 1]
        z = force_b[i, 2]
        out, up = arm_m * cos(pitch), arm_m * sin(pitch)
        wrench[i, 0], wrench[i, 1], wrench[i, 2] = x, y, z
        wrench[i, 3] = out * s * z - up * y
        wrench[i, 4] = up * x - out * c * z
        wrench[i, 5] = out * (c * y - s * x)
