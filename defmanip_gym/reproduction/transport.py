"""The slow transport: plant and control law alone, for half a million samples.

A Gymnasium step would spend its time on observation, reward and info, and most of what is left
would go into models that hardly change from sample to sample. So the outer loop (velocity field,
tracking (20)) runs every two seconds, and with it the force law (10) and the feedback linearization
(28) are expanded to first order; the force loop (29) in between uses the expansions. The control
law is that of ``baselines.analytic.cascade``; ``tests/reproduction`` holds the expansions
against the functions themselves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from defmanip_gym.baselines.analytic.cascade import Cascade, LoopMemory
from defmanip_gym.baselines.analytic.grasp_sample import GraspSample
from defmanip_gym.envs.survey import clean_observations
from defmanip_gym.errors import DivergenceError
from defmanip_gym.evaluation.readings import heading_error, position_from_goal
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.reproduction.course import POSITION, VELOCITY, Course, CourseRecorder
from defmanip_gym.reproduction.local_model import LocalModel, local_model
from defmanip_gym.reproduction.setting import LoopStage, PaperSetting
from defmanip_gym.theory.control.velocity_field import NormalizedField
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.frames import base_to_world
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.theory.payload.object_model import HangingBeam


class PaperLoop:
    """One plant under the paper's control law.

    Args:
        setting: of the transport.
    """

    def __init__(self, setting: PaperSetting) -> None:
        config = setting.environment
        self._setting, self._config = setting, config
        self._physics_period_s = config.task.physics_period_s
        self._kinematics = ArmKinematics(config.robot)
        self._layout = ObservationLayout(config.beam.segment_count)
        reach = config.goal_reach_and_height_m[0]
        self._linearization = FeedbackLinearization(
            config.believed_robot,
            config.believed_beam,
            RedundancyResolution(config.believed_robot, goal_reach_m=reach),
        )
        self._simulation = Simulation(
            config.robot,
            config.payload.body(),
            count=1,
            goal_position_m=config.goal_position_m,
            physics_period_s=self._physics_period_s,
            num_threads=1,
        )
        self._stage = setting.stages[0]
        self._cascade = _cascade(setting)
        self._memory = LoopMemory.empty(1)
        self._force_error = np.zeros((1, 3))
        self._place()
        self._midway = self._simulation.read()
        self._seen = [self._midway]
        self.time_s = 0.0

    def enter(self, stage: LoopStage) -> None:
        """Sample as this stage says from now on; what cancels the bias, k2 ∫Δu_o, stays."""
        integral = self._memory.error_integral * (self._stage.gains.k2 / stage.gains.k2)
        self._memory = replace(self._memory, error_integral=integral)
        self._cascade = replace(self._cascade, gains=stage.gains, period_s=stage.period_s)
        self._stage = stage

    def advance(self) -> Array:
        """Run the outer loop once; return its instant in a course's columns, (15,)."""
        plant = self._simulation.read()
        observation = clean_observations(self._config, plant)
        sample = self._sample(plant, observation)
        u_o = self._cascade.tracking(sample)
        error_model = local_model(self._error_function, _error_inputs(self._midway, u_o)[0])
        inputs = _force_inputs(np.zeros((1, 3)), plant)[0]
        force_model = local_model(self._force_function, inputs)
        self._seen = [plant]
        for _ in range(self._stage.samples_per_update):
            self._feed_back(u_o, error_model, force_model)
        columns = (
            plant.base_pose,
            plant.joints,
            plant.swing,
            base_to_world(-self._layout.part(observation, "goal_offset_b"), plant.base_pose[:, 2]),
            sample.velocity_b,
            self._force_error,
        )
        return np.concatenate(columns, axis=1)[0]

    def seen(self) -> tuple[Array, Array]:
        """Return grasp velocity, (k, 3) m/s, and swing, (k, 1) rad, since the last ``advance``.

        In the middle of each of the k - 1 sampling periods, and at the instant before them.
        """
        seen = PlantState(*(np.concatenate(values) for values in zip(*self._seen, strict=True)))
        observation = clean_observations(self._config, seen)
        return self._layout.part(observation, "grasp_velocity_b"), seen.swing

    def _feed_back(self, u_o: Array, error_model: LocalModel, force_model: LocalModel) -> None:
        """Run the force loop and the plant for one sampling period."""
        self._force_error = error_model(_error_inputs(self._midway, self._memory.u_o))
        command = self._cascade.force_feedback(u_o, self._force_error, self._memory)
        self._memory = command.memory
        plant = self._simulation.read()
        self._simulation.apply(force_model(_force_inputs(command.w, plant)))
        self._simulation.push_grasp(self._disturbing_force())
        # The torques are held while the configuration moves on, so the acceleration is the wanted
        # one on average over the period, and on average only. A force read at its end would blame
        # the robot for the rest in proportion to the velocity, and outweigh the small ε.
        substeps = round(self._stage.period_s / self._physics_period_s)
        failed = self._simulation.step(substeps // 2)
        self._midway = self._simulation.read()
        self._seen.append(self._midway)
        if (failed | self._simulation.step(substeps - substeps // 2)).any():
            raise DivergenceError(
                "time_s", self.time_s, "a simulation that does not diverge", "Shorten the periods."
            )
        self.time_s += self._stage.period_s

    def _error_function(self, inputs: Array) -> Array:
        """Return Δu_o for rows of ``_error_inputs``."""
        swing, swing_rate, yaw_rate, force, u_o = np.split(inputs, (1, 2, 3, 6), axis=1)
        return self._cascade.object.acceleration_error(
            swing, swing_rate, yaw_rate[:, 0], u_o, force
        )

    def _force_function(self, inputs: Array) -> Array:
        """Return T_r for rows of ``_force_inputs``, for the middle of the period to come."""
        w, joints, rates, base, swing, swing_rate = np.split(inputs, (3, 5, 7, 9, 10), axis=1)
        half = 0.5 * (self._stage.period_s - self._physics_period_s)
        return self._linearization.generalized_forces(
            w, joints + half * rates, rates, base, swing + half * swing_rate, swing_rate
        )

    def _disturbing_force(self) -> Array:
        disturbance = self._config.disturbance
        phase = disturbance.force_frequency_rad_s * self.time_s
        push = disturbance.force_bias_n + disturbance.force_amplitude_n * math.sin(phase)
        return np.full((1, 3), push)

    def _sample(self, plant: PlantState, observation: Array) -> GraspSample:
        velocity_b = self._layout.part(observation, "grasp_velocity_b")
        return GraspSample(
            position=position_from_goal(observation, self._layout),
            heading=heading_error(observation, self._layout),
            velocity_b=velocity_b,
            yaw_rate=plant.base_velocity[:, 1],
            reach=self._kinematics.reach_and_height(plant.joints @ JOINT_TO_PITCH.T)[:, 0],
            reach_rate=velocity_b[:, 0] - plant.base_velocity[:, 0],
            swing=plant.swing,
            swing_rate=plant.swing_rate,
            force_b=plant.grasp_force_b,
        )

    def _place(self) -> None:
        """Put the plant at the start, held by the forces that the nominal model asks for."""
        start, ids = np.array([self._setting.start]), np.arange(1)
        joints, swing, still = start[:, 3:5], start[:, 5:], np.zeros((1, 2))
        self._simulation.place(ids, start[:, :3], joints, swing)
        forces = self._linearization.generalized_forces(
            np.zeros((1, 3)), joints, still, still, swing, np.zeros_like(swing)
        )
        self._simulation.hold(ids, forces)


def run_transport(setting: PaperSetting, on_progress: Callable[[float], None]) -> Course:
    """Transport the beam until it has arrived or time is up.

    Args:
        setting: of the transport.
        on_progress: gets the simulated time after every window of the course.

    Raises:
        DivergenceError: the plant diverged.
    """
    loop, recorder = PaperLoop(setting), CourseRecorder()
    for stage in setting.stages:
        loop.enter(stage)
        end_s = min(stage.end_s, setting.max_duration_s)
        while loop.time_s < end_s - 1e-6:
            window = recorder.add(loop.time_s, loop.advance())
            recorder.note_extremes(*loop.seen())
            if window is not None:
                on_progress(loop.time_s)
                if has_arrived(window, setting):
                    return recorder.course(loop.time_s)
    return recorder.course(loop.time_s)


def has_arrived(window: Array, setting: PaperSetting) -> bool:
    """Whether the grasp stays at the goal throughout a window, (samples, 15)."""
    distance = np.linalg.norm(window[:, POSITION], axis=1).max()
    speed = np.linalg.norm(window[:, VELOCITY], axis=1).max()
    return bool(distance < setting.arrival_m and speed < setting.arrival_speed_m_s)


def _cascade(setting: PaperSetting) -> Cascade:
    config, stage = setting.environment, setting.stages[0]
    return Cascade(
        object=HangingBeam(config.beam, damping=setting.force_law_damping),
        field=NormalizedField(
            max_speed_m_s=setting.field_speed,
            # no braking distance: the approach rate alone shapes the arrival
            deceleration_m_s2=setting.speed_bound,
            vertical_deceleration_m_s2=setting.speed_bound,
            approach_rate_per_s=setting.approach_rate,
        ),
        tracking_gain=setting.tracking_gain,
        gains=stage.gains,
        u_o_bound=np.full(3, setting.nu_max - setting.speed_bound),  # the s of Eq. (19)
        w_limit=config.task.max_acceleration_m_s2,
        yaw_rate_bound=1.0,
        period_s=stage.period_s,
        feedforward=False,
    )


def _error_inputs(midway: PlantState, u_o: Array) -> Array:
    return np.concatenate(
        (
            midway.swing,
            midway.swing_rate,
            midway.base_velocity[:, 1:],
            midway.grasp_force_b,
            u_o,
        ),
        axis=1,
    )


def _force_inputs(w: Array, plant: PlantState) -> Array:
    return np.concatenate(
        (w, plant.joints, plant.joint_rates, plant.base_velocity, plant.swing, plant.swing_rate),
        axis=1,
    )
