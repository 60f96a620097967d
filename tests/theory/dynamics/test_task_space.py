import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.params import BeamParams, LinkParams, RobotParams
from defmanip_gym.theory.dynamics.robot_model import (
    JOINT_TO_PITCH,
    QUASI_TO_PITCH,
    ArmKinematics,
    robot_chain,
    robot_dynamics,
)
from defmanip_gym.theory.dynamics.task_space import combined_task_dynamics, task_space_dynamics
from defmanip_gym.theory.payload.object_model import HangingBeam, hanging_pitch

seeds = st.integers(0, 10**6)
STEP = 1e-6
robots = st.builds(
    RobotParams,
    base_mass_kg=st.floats(5, 100),
    base_yaw_inertia_kgm2=st.floats(0.2, 10),
    upper_arm=st.builds(LinkParams, length_m=st.floats(0.3, 1), mass_kg=st.floats(0.5, 10)),
    forearm=st.builds(LinkParams, length_m=st.floats(0.3, 1), mass_kg=st.floats(0.5, 10)),
    joint_armature_kgm2=st.floats(0, 2),
)


def random_arm(seed):
    """Return pitch, pitch rate and base velocity, elbow bent and grasp ahead of the axle."""
    rng = np.random.default_rng(seed)
    joints = np.array([rng.uniform(0.5, 1.4), rng.uniform(-1.5, -0.7)])
    return JOINT_TO_PITCH @ joints, rng.normal(size=2), rng.normal(size=2)


def world(heading):
    cos, sin = np.cos(heading), np.sin(heading)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def quasi_velocity(rate, base_velocity):
    return np.linalg.solve(QUASI_TO_PITCH, np.concatenate((base_velocity, rate)))


def slope_along_motion(function, pitch, rate, base_velocity):
    """Central difference in time of ``function(heading, pitch)`` while the robot coasts."""

    def at(t):
        return function(base_velocity[1] * t, pitch + rate * t)

    return (at(STEP) - at(-STEP)) / (2 * STEP)


@given(robots, seeds)
def test_bias_acceleration_is_the_slope_of_the_jacobian_in_the_world(robot, seed):
    pitch, rate, base_velocity = random_arm(seed)
    arm = ArmKinematics(robot)
    slope = slope_along_motion(
        lambda heading, at: world(heading) @ arm.task_jacobian(at), pitch, rate, base_velocity
    )
    expected = slope @ quasi_velocity(rate, base_velocity)
    bias = arm.task_bias_acceleration(pitch, rate, base_velocity)
    np.testing.assert_allclose(bias, expected, atol=1e-7)


@given(robots, seeds)
def test_equation_3_is_what_the_robot_does_at_the_grasp(robot, seed):
    pitch, rate, base_velocity = random_arm(seed)
    rng = np.random.default_rng(seed)
    T_r, force = 20 * rng.normal(size=4), 20 * rng.normal(size=3)
    arm = ArmKinematics(robot)
    inertia, bias = robot_dynamics(robot, pitch, rate, base_velocity)
    jacobian = arm.task_jacobian(pitch)
    u_dot = np.linalg.solve(inertia, T_r - jacobian.T @ force - bias)
    acceleration = jacobian @ u_dot + arm.task_bias_acceleration(pitch, rate, base_velocity)
    task = task_space_dynamics(robot, pitch, rate, base_velocity)
    np.testing.assert_allclose(
        task.inertia @ acceleration + task.bias,
        task.task_force(T_r) - force,
        atol=1e-8 * np.abs(task.inertia).max() * (1 + np.abs(acceleration).max()),
    )


def test_printed_bias_with_the_dot_on_the_inertia_breaks_equation_3():
    robot = RobotParams()
    pitch, rate, base_velocity = random_arm(seed=4)
    arm = ArmKinematics(robot)
    task = task_space_dynamics(robot, pitch, rate, base_velocity)

    def inertia_w(heading, at):
        still = np.zeros(2)
        inertia = task_space_dynamics(robot, at, still, still).inertia
        return world(heading) @ inertia @ world(heading).T

    velocity = arm.task_jacobian(pitch) @ quasi_velocity(rate, base_velocity)
    printed = slope_along_motion(inertia_w, pitch, rate, base_velocity) @ velocity
    corrected = task.inertia @ arm.task_bias_acceleration(pitch, rate, base_velocity)
    assert np.abs(printed - corrected).max() > 1.0  # N


@given(robots, seeds)
def test_pseudoinverse_inverts_the_jacobian_without_moving_the_grasp_by_null_torques(robot, seed):
    pitch, rate, base_velocity = random_arm(seed)
    task = task_space_dynamics(robot, pitch, rate, base_velocity)
    jacobian = ArmKinematics(robot).task_jacobian(pitch)
    np.testing.assert_allclose(jacobian @ task.pseudoinverse, np.eye(3), atol=1e-7)
    # dynamic consistency: torques (I − J_Aᵀ J̄_Aᵀ) τ do not accelerate the grasp
    inertia = robot_dynamics(robot, pitch, rate, base_velocity)[0]
    null = np.eye(4) - jacobian.T @ task.pseudoinverse.T
    moved = jacobian @ np.linalg.solve(inertia, null)
    np.testing.assert_allclose(moved, 0.0, atol=1e-8)


def acceleration_in_the_combined_chain(robot, beam, w, arm_state, swing, swing_rate):
    """Return ẍ_a in Eq. (7) under T_r = J_Aᵀ 𝒯 with 𝒯 from Eq. (28)."""
    pitch, rate, base_velocity = arm_state
    arm, chain = ArmKinematics(robot), robot_chain(robot, beam)
    combined = combined_task_dynamics(robot, beam, *arm_state, swing, swing_rate)
    T_r = arm.task_jacobian(pitch).T @ combined.linearizing_task_force(w)
    alpha = np.concatenate((pitch, hanging_pitch(swing)))
    velocity = np.concatenate((base_velocity, rate, swing_rate))
    model = HangingBeam(beam)
    passive = model.d_o22 @ swing_rate + model.k_o22 @ swing
    forces = np.concatenate((np.linalg.solve(QUASI_TO_PITCH.T, T_r), -passive))
    v_dot = np.linalg.solve(chain.mass_matrix(alpha), forces - chain.bias(alpha, velocity))
    u_dot = np.linalg.solve(QUASI_TO_PITCH, v_dot[:4])
    return arm.task_jacobian(pitch) @ u_dot + arm.task_bias_acceleration(*arm_state)


beams = st.builds(
    BeamParams,
    mass_kg=st.floats(0.2, 10),
    length_m=st.floats(0.3, 1.5),
    damping=st.floats(0, 2),
    segment_count=st.integers(1, 4),
    radius_m=st.just(1e-4),
)


@given(robots, beams, seeds)
def test_equation_28_gives_the_grasp_the_acceleration_w(robot, beam, seed):
    rng = np.random.default_rng(seed)
    w, swing_rate = rng.normal(size=3), rng.normal(size=beam.segment_count)
    # hanging: the object is a force at the grasp, as Eq. (6) has it, in all three directions
    hanging = np.zeros(beam.segment_count)
    measured = acceleration_in_the_combined_chain(
        robot, beam, w, random_arm(seed), hanging, swing_rate
    )
    np.testing.assert_allclose(measured, w, atol=1e-5)
    # swung out it also takes a yaw moment, which Eq. (6) does not know (docs/derivations.md)
    swing = rng.uniform(-0.5, 0.5, beam.segment_count)
    measured = acceleration_in_the_combined_chain(
        robot, beam, w, random_arm(seed), swing, swing_rate
    )
    np.testing.assert_allclose(measured[[0, 2]], w[[0, 2]], atol=1e-6)


def test_printed_sign_of_n_lets_the_grasp_fall():
    robot, beam = RobotParams(), BeamParams()
    arm_state, rest = (np.array([np.pi / 2, 0.0]), np.zeros(2), np.zeros(2)), np.zeros(1)
    combined = combined_task_dynamics(robot, beam, *arm_state, rest, rest)
    printed = -combined.inertia @ combined.bias  # […](w − N) at w = 0
    acceleration = np.linalg.solve(combined.inertia, printed - combined.bias)
    assert acceleration[2] < -9.81


@pytest.mark.parametrize("batch", [(3,), (2, 3)])
def test_batches_equal_single_states(batch):
    rng = np.random.default_rng(0)
    states = [random_arm(seed) for seed in rng.integers(0, 1000, np.prod(batch))]
    stacked = [np.stack(part).reshape(*batch, 2) for part in zip(*states, strict=True)]
    swing, swing_rate = rng.uniform(-0.5, 0.5, (2, *batch, 2))
    beam = BeamParams(segment_count=2)
    together = combined_task_dynamics(RobotParams(), beam, *stacked, swing, swing_rate)
    for index in np.ndindex(*batch):
        single = combined_task_dynamics(
            RobotParams(), beam, *(part[index] for part in stacked), swing[index], swing_rate[index]
        )
        np.testing.assert_allclose(together.inertia[index], single.inertia)
        np.testing.assert_allclose(together.bias[index], single.bias)
