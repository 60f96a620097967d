import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from defmanip_gym.params import RobotParams
from defmanip_gym.theory.dynamics.pseudoinverse_resolution import PseudoinverseResolution
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics, robot_dynamics

ROBOT = RobotParams()
ARM = ArmKinematics(ROBOT)
PSEUDOINVERSE = PseudoinverseResolution(ROBOT)
SECTION_IV_B = RedundancyResolution(ROBOT, goal_reach_m=0.7)
START = JOINT_TO_PITCH @ np.array([np.pi / 3, -np.pi / 2])


def to_quasi(accelerations):
    """From (u̇1, u̇2, α̈) to u̇ = (u̇1, u̇2, q̈_a)."""
    return np.concatenate((accelerations[:2], np.linalg.solve(JOINT_TO_PITCH, accelerations[2:])))


@given(st.integers(0, 10**6))
def test_both_resolutions_realize_w_and_the_pseudoinverse_with_the_smaller_norm(seed):
    rng = np.random.default_rng(seed)
    pitch = JOINT_TO_PITCH @ np.array([rng.uniform(0.8, 1.4), rng.uniform(-1.6, -0.8)])
    rate, base_velocity, w = rng.normal(size=2), rng.normal(size=2), rng.normal(size=3)
    inertia = robot_dynamics(ROBOT, pitch, rate, base_velocity)[0]
    costs = []
    for resolution in (PSEUDOINVERSE, SECTION_IV_B):
        u_dot = to_quasi(resolution.accelerations(w, pitch, rate, base_velocity))
        resulting = ARM.task_jacobian(pitch) @ u_dot
        resulting = resulting + ARM.task_bias_acceleration(pitch, rate, base_velocity)
        np.testing.assert_allclose(resulting, w, atol=1e-8)
        costs.append(u_dot @ inertia @ u_dot)
    assert costs[0] <= costs[1] * (1 + 1e-9)


def self_motion(resolution, reach_rate, duration_s=30.0):
    """Return times and states (α, α̇, u1, u2) at w = 0 until the elbow is straight or folded."""
    rate = np.linalg.solve(ARM.jacobian(START), [reach_rate, 0.0])

    def slope(_, state):
        accelerations = resolution.accelerations(np.zeros(3), state[:2], state[2:4], state[4:])
        return np.concatenate((state[2:4], accelerations[2:], accelerations[:2]))

    def elbow_margin(_, state):
        bend = abs(state[0] - state[1])
        return min(bend, np.pi - bend) - 0.15

    elbow_margin.terminal = True
    start = np.concatenate((START, rate, [-reach_rate, 0.0]))
    return solve_ivp(slope, (0, duration_s), start, events=elbow_margin, rtol=1e-7, atol=1e-9)


def grasp_speed(state):
    joint_rates = np.linalg.solve(JOINT_TO_PITCH, state[2:4])
    return ARM.task_jacobian(state[:2]) @ np.concatenate((state[4:], joint_rates))


@pytest.mark.parametrize("reach_rate", [0.02, 0.05])
def test_pseudoinverse_lets_a_small_self_motion_stretch_the_arm_while_the_grasp_stands(reach_rate):
    motion = self_motion(PSEUDOINVERSE, reach_rate)
    assert motion.status == 1  # the elbow is straight
    end = motion.y[:, -1]
    np.testing.assert_allclose(grasp_speed(end), 0.0, atol=1e-6)
    # the joints have not slowed down
    assert np.abs(end[2:4]).max() > np.abs(motion.y[2:4, 0]).max()


@pytest.mark.parametrize("reach_rate", [-0.05, 0.02, 0.05])
def test_section_iv_b_settles_at_the_goal_reach_while_the_grasp_stands(reach_rate):
    motion = self_motion(SECTION_IV_B, reach_rate)
    assert motion.status == 0
    end = motion.y[:, -1]
    np.testing.assert_allclose(grasp_speed(end), 0.0, atol=1e-6)
    assert ARM.reach_and_height(end[:2])[0] == pytest.approx(0.7, abs=1e-3)
    np.testing.assert_allclose(end[2:], 0.0, atol=1e-3)
