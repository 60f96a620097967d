"""How far a robot's motion is from what a filter foresees: searched for on the plant.

Forces hold for a control period while beam and robot move on, the inner loop believes in a beam
that may not be the true one, and actuators, speed limit and disturbances have their say. None of it
is a constant: it follows from robot, beam, periods and beliefs. So it is measured for each
environment, at hundreds of motions that the filter admits and under the wildest commands.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.disturbance_ranges import DisturbanceRanges
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.disturbance import EpisodeDisturbances
from defmanip_gym.envs.inner_loop import InnerLoop
from defmanip_gym.envs.survey import clean_observations
from defmanip_gym.errors import CertificateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.theory.dynamics.frames import base_to_world
from defmanip_gym.theory.filters.safety_filter import SafetyFilter
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.wrappers.admissible_motions import Motions

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_READINGS = 8  # at most, within a period
_LATEST_START = 5000  # control periods; disturbances depend on the time
_MOST_WORK = 200  # segments times physics steps in a control period; a few seconds of search


class PeriodErrors(NamedTuple):
    """What a control period of n searched motions brought.

    Attributes:
        surprise: accelerations beside those foreseen, (n, 3) m/s².
        stray: mean distance of the grasp's forward velocity from the line between samples, (n,)
            m/s.
        yaw_rate: u2 at its end, (n,) rad/s.
        counted: where what happened before is known to the filter, (n,).
        before: observations at its beginning, (n, size).
        after: and at its end.
        memory: of the filter, which has concluded the period.
    """

    surprise: Array
    stray: Array
    yaw_rate: Array
    counted: BoolArray
    before: Array
    after: Array
    memory: Any


def require_affordable(config: TransportConfig) -> None:
    """Raise CertificateError where the search would take too long."""
    work = config.payload.count * config.task.substeps
    if work > _MOST_WORK:
        raise CertificateError(
            "segments times physics steps in a control period",
            work,
            f"at most {_MOST_WORK}, to search for errors",
            "Use longer physics steps, shorter control periods or fewer segments.",
        )


def worst_cases(config: TransportConfig) -> Iterator[TransportConfig]:
    """Yield an environment with each of its extreme payloads, disturbed the most."""
    payloads = config.payload.extremes
    disturbances = config.disturbance_ranges.worst(config.disturbance, config.task.control_period_s)
    for payload, disturbance in product(payloads, disturbances):
        yield replace(
            config,
            payload=payload,
            disturbance=disturbance,
            disturbance_ranges=DisturbanceRanges(),
        )


class ErrorSearch:
    """Some of the robots start from rest, the others are on their way.

    Args:
        config: the environment's definition, with what is carried.
        safety_filter: that is enforced.
        resting: motions of robots at rest.
        moving: and of robots on their way.
        rng: draws times and commands.
        periods: of each motion; what the first ones show a filter cannot know beforehand.
        delay_periods: control periods until a command takes effect.
    """

    def __init__(
        self,
        config: TransportConfig,
        safety_filter: SafetyFilter,
        resting: Motions,
        moving: Motions,
        rng: np.random.Generator,
        *,
        periods: int,
        delay_periods: int = 0,
    ) -> None:
        count = len(resting.joints) + len(moving.joints)
        self._config, self._count, self._rng = config, count, rng
        self._layout = ObservationLayout(config.payload.count)
        self._simulation = Simulation(
            config.robot,
            config.payload.body(),
            count=count,
            goal_position_m=config.goal_position_m,
            physics_period_s=config.task.physics_period_s,
            num_threads=1,
        )
        self._inner_loop = InnerLoop(config, self._simulation.generalized_forces)
        self._filter, self._memory = safety_filter, safety_filter.memory(count)
        self._disturbances = EpisodeDisturbances(config, [rng] * count)
        self._moving = np.arange(count) >= len(resting.joints)
        self._place(resting, ~self._moving)
        self._place(moving, self._moving)
        if self._inner_loop.feels:
            self._feel_first()
        self._steps = rng.integers(0, np.where(self._moving, _LATEST_START, 1))
        self._under_way = deque(np.zeros((delay_periods, count, 3)))
        # what a robot on its way would have felt is known after its first period only
        self._unfelt = 1 if self._inner_loop.feels else 0
        self._periods, self._unknown = periods, 1 + delay_periods + self._unfelt

    def _place(self, motions: Motions, where: BoolArray) -> None:
        ids = np.flatnonzero(where)
        self._simulation.place(ids, np.zeros((len(ids), 3)), motions.joints, motions.swing)
        self._simulation.move(ids, motions.base_velocity, motions.joint_rates, motions.swing_rate)

    def periods(self) -> Iterator[PeriodErrors]:
        """Step through the periods."""
        before = self._observed()
        self._filter.begin(self._memory, before, np.ones(self._count, dtype=bool))
        for period in range(self._periods + len(self._under_way) + self._unfelt):
            decision = self._filter.certify_action(self._wild_commands(), before, self._memory)
            self._under_way.append(decision.allowed_m_s2)
            after, stray = self._advance(self._under_way.popleft(), before)
            surprise = np.abs(self._filter.conclude(after, self._memory))
            counted = np.ones(self._count, dtype=bool) if period >= self._unknown else ~self._moving
            yaw_rate = self._layout.part(after, "base_velocity")[:, 1]
            yield PeriodErrors(surprise, stray, yaw_rate, counted, before, after, self._memory)
            before = after

    def _wild_commands(self) -> Array:
        limit = self._config.task.max_acceleration_m_s2
        return limit * self._rng.choice((-1.0, 1.0), (self._count, 3))

    def _advance(self, command: Array, before: Array) -> tuple[Array, Array]:
        """Step a control period; return the observation at its end and the mean stray, (n,) m/s."""
        task, simulation = self._config.task, self._simulation
        plant = simulation.read()
        self._inner_loop.write_forces(
            command / task.max_acceleration_m_s2, plant, simulation.generalized_forces
        )
        if self._disturbances.has_force:
            simulation.push_grasp(self._disturbances.force(self._steps))
        at_a_time = -(-task.substeps // _READINGS)
        start = Sensed.observed(self._layout, before)
        times, velocities = [0.0], [start.velocity_b]
        while (done := round(times[-1] / task.physics_period_s)) < task.substeps:
            taken = min(at_a_time, task.substeps - done)
            simulation.step(taken)
            times.append((done + taken) * task.physics_period_s)
            observation = self._observed()
            now = Sensed.observed(self._layout, observation)
            velocities.append(base_to_world(now.velocity_b, now.heading - start.heading))
        if self._inner_loop.feels:
            later = simulation.read()
            self._inner_loop.feel(plant, later, self._as_read(later.grasp_force_b))
        self._steps = self._steps + 1
        shares = np.array(times)[:, None, None] / times[-1]
        line = velocities[0] + shares * (velocities[-1] - velocities[0])
        stray = np.abs(np.array(velocities) - line)[:, :, 0].mean(axis=0)
        return observation, stray

    def _feel_first(self) -> None:
        """Let sensors read what holding the object still would take, and then what that causes."""
        everybody, simulation = np.arange(self._count), self._simulation
        weight = np.zeros((self._count, 3))
        weight[:, 2] = self._config.payload.mass_kg * GRAVITY_M_S2
        self._inner_loop.begin(everybody, self._as_read(weight), np.zeros((self._count, 1)))
        forces, plant = np.zeros_like(simulation.generalized_forces), simulation.read()
        self._inner_loop.write_forces(np.zeros((self._count, 3)), plant, forces)
        simulation.hold(everybody, forces)
        self._inner_loop.feel(plant, plant, self._as_read(simulation.read().grasp_force_b))

    def _as_read(self, force_b: Array) -> Array:
        """Return forces, (n, 3) N, as the noisy sensor reads them."""
        noise_n = self._config.disturbance.force_sensor_noise_n
        return force_b + noise_n * self._rng.standard_normal(force_b.shape)

    def _observed(self) -> Array:
        return clean_observations(self._config, self._simulation.read())
