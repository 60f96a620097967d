import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import RobotParams
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution, task_planes
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.theory.dynamics.task_space import task_inertia

ROBOT = RobotParams()
ARM = ArmKinematics(ROBOT)
RESOLUTION = RedundancyResolution(ROBOT, goal_reach_m=0.7)


def random_arm(seed):
    rng = np.random.default_rng(seed)
    joints = np.array([rng.uniform(0.8, 2.0), rng.uniform(-2.2, -0.8)])
    return JOINT_TO_PITCH @ joints, rng.normal(size=2), rng.normal(size=2), rng.normal(size=3)


def grasp_velocity(heading, u1, u2, pitch, pitch_rate):
    """Inertial velocity of the grasp, world frame."""
    reach = ARM.reach_and_height(pitch)[0]
    along = ARM.jacobian(pitch) @ pitch_rate
    forward, left = u1 + along[0], reach * u2
    cos, sin = np.cos(heading), np.sin(heading)
    return np.array([cos * forward - sin * left, sin * forward + cos * left, along[1]])


@given(st.integers(0, 10**6))
def test_grasp_accelerates_by_w_whatever_the_arm_does(seed):
    pitch, rate, (u1, u2), w = random_arm(seed)
    base_velocity = np.array([u1, u2])
    u1_dot, u2_dot, *pitch_acceleration = RESOLUTION.accelerations(w, pitch, rate, base_velocity)
    step = 1e-6

    def ahead(t):
        return grasp_velocity(
            u2 * t,
            u1 + u1_dot * t,
            u2 + u2_dot * t,
            pitch + rate * t + 0.5 * np.array(pitch_acceleration) * t**2,
            rate + np.array(pitch_acceleration) * t,
        )

    measured = (ahead(step) - ahead(-step)) / (2 * step)
    np.testing.assert_allclose(measured, w, atol=1e-6 * (1 + np.abs(pitch_acceleration).max()))


@given(st.integers(0, 10**6))
def test_reach_settles_at_the_goal_reach(seed):
    pitch, rate, base_velocity, w = random_arm(seed)
    acceleration = RESOLUTION.accelerations(w, pitch, rate, base_velocity)[2:]
    jacobian, bias = ARM.jacobian(pitch), ARM.bias_acceleration(pitch, rate)
    reach_acceleration = (jacobian @ acceleration + bias)[0]
    reach, reach_rate = ARM.reach_and_height(pitch)[0], (jacobian @ rate)[0]
    # (s + k)(s + k3) up to the order of k k3: damped towards ρ* from either side
    expected = -RESOLUTION.rule.k3 * (reach_rate + RESOLUTION.rule.k * (reach - 0.7))
    assert reach_acceleration == pytest.approx(expected, abs=1e-8)


@given(st.integers(0, 10**6))
def test_task_jacobian_maps_quasi_velocities_to_the_grasp_velocity(seed):
    pitch, _, (u1, u2), _ = random_arm(seed)
    joint_rates = np.random.default_rng(seed).normal(size=2)
    by_jacobian = ARM.task_jacobian(pitch) @ np.array([u1, u2, *joint_rates])
    direct = grasp_velocity(0.0, u1, u2, pitch, JOINT_TO_PITCH @ joint_rates)
    np.testing.assert_allclose(by_jacobian, direct, atol=1e-12)


@given(st.integers(0, 10**6))
def test_task_inertia_is_symmetric_positive_and_decouples_the_lateral_axis(seed):
    inertia = task_inertia(ROBOT, random_arm(seed)[0])
    np.testing.assert_allclose(inertia, inertia.T, rtol=1e-6, atol=1e-9)
    assert np.linalg.eigvalsh(inertia)[0] > 0
    np.testing.assert_allclose(inertia[1, [0, 2]], 0.0, atol=1e-9)


@given(st.integers(0, 10**6))
def test_base_spans_the_horizontal_plane_and_the_arm_what_is_left(seed):
    pitch = random_arm(seed)[0]
    base_jacobian = ARM.task_jacobian(pitch)[:, :2]
    S_b, S_a = task_planes(base_jacobian)
    np.testing.assert_allclose(S_b, np.diag([1.0, 1.0, 0.0]), atol=1e-12)
    np.testing.assert_allclose(S_a, np.diag([0.0, 0.0, 1.0]), atol=1e-12)
    np.testing.assert_allclose(S_b @ base_jacobian, base_jacobian, atol=1e-12)


@given(st.integers(0, 10**6))
def test_base_does_s_b_w_and_arm_s_a_w_once_the_reach_has_settled(seed):
    rng = np.random.default_rng(seed)
    shoulder = rng.uniform(0.9, 1.5)
    # elbow placed so that the reach is the goal's
    elbow = -np.arccos((0.7 - 0.6 * np.cos(shoulder)) / 0.7)
    pitch, still, w = np.array([shoulder, elbow]), np.zeros(2), rng.normal(size=3)
    S_b, S_a = task_planes(ARM.task_jacobian(pitch)[:, :2])
    accelerations = RESOLUTION.accelerations(w, pitch, still, still)
    jacobian = ARM.task_jacobian(pitch)
    np.testing.assert_allclose(jacobian[:, :2] @ accelerations[:2], S_b @ w, atol=1e-9)
    arm = ARM.jacobian(pitch) @ accelerations[2:]
    np.testing.assert_allclose([arm[0], 0.0, arm[1]], S_a @ w, atol=1e-9)


@pytest.mark.parametrize("bad", [{"goal_reach_m": 0.0}, {"goal_reach_m": 0.7, "k": -1}])
def test_bad_gains_are_refused(bad):
    with pytest.raises(ParameterError):
        RedundancyResolution(ROBOT, **bad)
