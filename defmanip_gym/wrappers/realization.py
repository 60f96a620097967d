"""How far a robot's grasp acceleration is from what was commanded: searched for on the plant.

Forces hold for a control period while beam and robot move on, the inner loop believes in a beam
that may not be the true one, and actuators, speed limit and disturbances have their say. None of it
is a constant: it follows from robot, beam, periods and beliefs. So it is measured for each
environment, at hundreds of motions that the certificate admits and under the wildest commands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.disturbance import disturbing_force
from defmanip_gym.envs.inner_loop import InnerLoop
from defmanip_gym.envs.survey import clean_observations
from defmanip_gym.errors import CertificateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamRanges
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.error_budget import ErrorBudget
from defmanip_gym.wrappers.admissible_motions import Motions, moving_motions, resting_motions
from defmanip_gym.wrappers.certified_motion import CertifiedMotion, GraspMotion

Array = NDArray[np.float64]

_COUNT, _RESTING = 1024, 128  # motions searched, and those of them that start from rest
_PERIODS = 3  # of each; the first shows what the wrapper cannot know beforehand
_READINGS = 8  # at most, within a period
_LATEST_START = 5000  # control periods; disturbances depend on the time
_MOST_WORK = 200  # segments times physics steps in a control period; a few seconds of search
_MARGIN = 1.1  # on what the search finds


@dataclass(frozen=True, kw_only=True)
class RealizationErrors:
    """The largest errors found, with a margin of a tenth.

    Attributes:
        room_m_s2: forward acceleration that they need of a certificate's room; see ``ErrorBudget``.
        stray_m_s: mean distance of the grasp's velocity from the straight line between samples.
        yaw_rate_rad_s: largest |u2|, without a margin.
    """

    room_m_s2: float
    stray_m_s: float
    yaw_rate_rad_s: float


@lru_cache(maxsize=64)
def realization_errors(config: TransportConfig, certificate: Certificate) -> RealizationErrors:
    """Return how far the acceleration strays from what ``NuMaxActionScaling`` counts on.

    Args:
        config: the environment's definition, in task mode.
        certificate: for its beam; bounds and conditions are enforced in the search.

    Raises:
        CertificateError: the search would take too long.
    """
    work = config.beam.segment_count * config.task.substeps
    if work > _MOST_WORK:
        raise CertificateError(
            "segments times physics steps in a control period",
            work,
            f"at most {_MOST_WORK}, to search for errors",
            "Use longer physics steps, shorter control periods or fewer segments.",
        )
    each = []
    for beam in dict.fromkeys(config.beam_ranges.extremes(config.beam)):
        carried = replace(
            config, beam=beam, nominal_beam=config.believed_beam, beam_ranges=BeamRanges()
        )
        each.append(_Search(carried, certificate).errors())
    return RealizationErrors(
        room_m_s2=max(errors.room_m_s2 for errors in each),
        stray_m_s=max(errors.stray_m_s for errors in each),
        yaw_rate_rad_s=max(errors.yaw_rate_rad_s for errors in each),
    )


class _Search:
    """Some of the robots start from rest, the others are on their way."""

    def __init__(self, config: TransportConfig, certificate: Certificate) -> None:
        self._config, self._count = config, _COUNT
        self._rng = np.random.default_rng(0)
        self._layout = ObservationLayout(config.beam.segment_count)
        self._simulation = Simulation(
            config.robot,
            config.beam,
            count=_COUNT,
            goal_position_m=config.goal_position_m,
            physics_period_s=config.task.physics_period_s,
            num_threads=1,
        )
        self._inner_loop = InnerLoop(config, self._simulation.generalized_forces)
        self._motion = CertifiedMotion(config, certificate, _COUNT)
        self._budget = ErrorBudget.of(
            certificate, [config.beam], physics_period_s=config.task.physics_period_s
        )
        self._moving = np.arange(_COUNT) >= _RESTING
        self._place(resting_motions(config, certificate, _RESTING, self._rng), ~self._moving)
        self._place(moving_motions(config, certificate, _COUNT - _RESTING, self._rng), self._moving)
        latest = np.where(self._moving, _LATEST_START, 1)
        self._steps = self._rng.integers(0, latest)

    def _place(self, motions: Motions, where: NDArray[np.bool_]) -> None:
        ids = np.flatnonzero(where)
        self._simulation.place(ids, np.zeros((len(ids), 3)), motions.joints, motions.swing)
        self._simulation.move(ids, motions.base_velocity, motions.joint_rates, motions.swing_rate)

    def errors(self) -> RealizationErrors:
        """Return the largest errors."""
        room = stray = yaw_rate = 0.0
        before = self._read()
        self._motion.begin(np.ones(self._count, dtype=bool))
        for period in range(_PERIODS):
            command = self._motion.certified(self._wild_commands(), before)
            after, strays = self._advance(command, before)
            surprise = np.abs(self._motion.conclude(after))
            needed = self._budget.needed(surprise[:, 0], surprise[:, 2], strays)
            # what happened before a moving robot's first period is not known
            counted = needed if period else needed[~self._moving]
            room, stray = max(room, float(counted.max())), max(stray, float(strays.max()))
            yaw_rate = max(yaw_rate, float(np.abs(after.yaw_rate).max()))
            before = after
        return RealizationErrors(
            room_m_s2=_MARGIN * room, stray_m_s=_MARGIN * stray, yaw_rate_rad_s=yaw_rate
        )

    def _wild_commands(self) -> Array:
        limit = self._config.task.max_acceleration_m_s2
        return limit * self._rng.choice((-1.0, 1.0), (self._count, 3))

    def _advance(self, command: Array, before: GraspMotion) -> tuple[GraspMotion, Array]:
        """Step a control period; return the motion at its end and the mean stray, (n,) m/s."""
        task, simulation = self._config.task, self._simulation
        self._inner_loop.write_forces(
            command / task.max_acceleration_m_s2, simulation.read(), simulation.generalized_forces
        )
        if self._config.disturbance.has_force:
            simulation.push_grasp(disturbing_force(self._config, self._steps))
        at_a_time = -(-task.substeps // _READINGS)
        times, velocities = [0.0], [before.velocity_b]
        while (done := round(times[-1] / task.physics_period_s)) < task.substeps:
            taken = min(at_a_time, task.substeps - done)
            simulation.step(taken)
            times.append((done + taken) * task.physics_period_s)
            now = self._read()
            velocities.append(now.turned_from(before))
        self._steps = self._steps + 1
        shares = np.array(times)[:, None, None] / times[-1]
        line = velocities[0] + shares * (velocities[-1] - velocities[0])
        stray = np.abs(np.array(velocities) - line)[:, :, 0].mean(axis=0)
        return now, stray

    def _read(self) -> GraspMotion:
        observation = clean_observations(self._config, self._simulation.read())
        return GraspMotion.observed(self._layout, observation)
