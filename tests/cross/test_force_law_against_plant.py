"""Eqs. (10) and (11b) against the plant's own force sensor and motion."""

import numpy as np
import pytest

from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.frames import world_to_base
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.theory.payload.object_model import HangingBeam

PERIOD_S = 2e-4


def grasp_velocity_w(state):
    arm = ArmKinematics(RobotParams())
    pitch, rate = state.joints @ JOINT_TO_PITCH.T, state.joint_rates @ JOINT_TO_PITCH.T
    reach = arm.reach_and_height(pitch)[:, 0]
    along = np.einsum("nij,nj->ni", arm.jacobian(pitch), rate)
    forward = state.base_velocity[:, 0] + along[:, 0]
    left = state.lateral_speed + reach * state.base_velocity[:, 1]
    cos, sin = np.cos(state.base_pose[:, 2]), np.sin(state.base_pose[:, 2])
    return np.stack((cos * forward - sin * left, sin * forward + cos * left, along[:, 1]), axis=1)


def moving_plant(make_plant, beam, forces, *, swing, periods):
    """Return states one physics step apart in the middle of a motion under constant forces."""
    plant = make_plant(beam, physics_period_s=PERIOD_S, swing=swing)
    plant.apply(np.array([forces]))
    for _ in range(periods // 4):
        plant.step(4)
    before = plant.read()
    plant.step(1)
    after = plant.read()
    acceleration_w = (grasp_velocity_w(after) - grasp_velocity_w(before)) / PERIOD_S
    return before, after, world_to_base(acceleration_w, before.base_pose[:, 2])


STRAIGHT = (70.0, 0.0, 55.0, 30.0)
TURNING = (120.0, 25.0, 55.0, 30.0)


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("forces", [STRAIGHT, TURNING])
def test_measured_force_is_the_linearizing_force_of_the_measured_motion(make_plant, count, forces):
    beam = BeamParams(segment_count=count, damping=0.6)
    state, after, acceleration = moving_plant(make_plant, beam, forces, swing=0.2, periods=1000)
    model, u2 = HangingBeam(beam), state.base_velocity[:, 1]
    expected = model.linearizing_force(state.swing, state.swing_rate, u2, acceleration)
    # (10) knows z1 only; a swung-out beam that the base turns needs this much more to the left
    moment = np.sin(state.swing) @ model.chain.constants.first_moments
    turning = (after.base_velocity[:, 1] - u2) / PERIOD_S
    expected[:, 1] += moment * turning
    assert np.abs(acceleration[0, 0]) > 0.5
    np.testing.assert_allclose(state.grasp_force_b, expected, atol=0.04)


@pytest.mark.parametrize("count", [1, 3])
def test_swing_accelerates_as_the_grasp_motion_dictates(make_plant, count):
    beam = BeamParams(segment_count=count, damping=0.6)
    state, after, acceleration = moving_plant(make_plant, beam, TURNING, swing=0.2, periods=1000)
    model = HangingBeam(beam)
    partition = model.partition(state.swing, state.swing_rate, state.base_velocity[:, 1])
    torque = model.internal_torque(partition, state.swing, state.swing_rate)
    torque = torque + np.einsum("nji,nj->ni", partition.m_o12, acceleration)
    expected = -np.linalg.solve(partition.m_o22, torque[..., None])[..., 0]
    measured = (after.swing_rate - state.swing_rate) / PERIOD_S
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(measured, expected, atol=0.1)


@pytest.mark.parametrize("physics_period_s", [0.001, 0.005])
def test_lateral_force_is_mass_times_lateral_acceleration_while_turning(
    make_plant, physics_period_s
):
    # with implicitfast the sensor reports the explicit no-slip force, kv h / M times too large
    plant = make_plant(physics_period_s=physics_period_s)
    plant._velocity[:, 0], plant._velocity[:, 2] = 1.0, 0.8
    linearization = FeedbackLinearization(
        RobotParams(), BeamParams(), RedundancyResolution(RobotParams(), goal_reach_m=0.7)
    )
    state = plant.read()
    for _ in range(4):
        # the beam hangs straight while the grasp goes on in inertial space but for the turn
        forces = linearization.generalized_forces(
            np.array([[0.0, 0.8, 0.0]]),
            state.joints,
            state.joint_rates,
            state.base_velocity,
            state.swing,
            state.swing_rate,
        )
        plant.apply(forces)
        plant.step(1)
        state = plant.read()
    assert state.grasp_force_b[0, 1] == pytest.approx(BeamParams().mass_kg * 0.8, rel=0.02)


@pytest.mark.parametrize("count", [1, 3])
def test_first_force_reading_is_the_plants_with_the_grasp_held(count):
    # no springs or dampers: the plant's integrator makes inertia of what they do in a step of 5 ms
    beam = BeamParams(segment_count=count, damping=0.0, joint_damping=0.0, joint_stiffness=0.0)
    env = DeformTransportVectorEnv(4, beam=beam, nominal_beam=beam)
    start = (-5.0, 2.0, 0.3, np.pi / 2, -np.pi / 2, 0.4)  # at ρ*, so the arm has no self-motion
    observation, _ = env.reset(options={"start": start})
    state, simulation = env.engine.plant_state, env.engine.simulation
    reach = ArmKinematics(RobotParams()).reach_and_height(np.array([np.pi / 2, 0.0]))[0]
    linearization = FeedbackLinearization(
        RobotParams(), beam, RedundancyResolution(RobotParams(), goal_reach_m=reach)
    )
    still = np.zeros((4, 2))
    simulation.hold(
        np.arange(4),
        linearization.generalized_forces(
            np.zeros((4, 3)), state.joints, still, still, state.swing, np.zeros_like(state.swing)
        ),
    )
    measured = simulation.read().grasp_force_b
    reported = env.engine.layout.part(observation, "grasp_force_b")
    np.testing.assert_allclose(reported, measured, rtol=0, atol=1e-9)
    assert np.abs(reported[:, 0]).min() > 1.0
