import mujoco
import numpy as np
import pytest

from defmanip_gym.params import BeamParams, LinkParams, RobotParams
from defmanip_gym.plant.builder import build_model
from defmanip_gym.plant.rod_body import RodBody
from defmanip_gym.theory.dynamics.robot_model import robot_chain
from defmanip_gym.theory.payload.object_model import HangingBeam

ROBOT = RobotParams(
    base_mass_kg=37.0,
    base_yaw_inertia_kgm2=1.7,
    upper_arm=LinkParams(length_m=0.55, mass_kg=4.0),
    forearm=LinkParams(length_m=0.8, mass_kg=2.5, radius_m=0.06),
    joint_armature_kgm2=0.6,
)


def random_state(count, seed):
    """Return MuJoCo data at a random state, α, v and the reduction S with Ṡ v."""
    rng = np.random.default_rng(seed)
    beam = BeamParams(mass_kg=2.2, length_m=0.9, damping=0.7, segment_count=count)
    model = build_model(ROBOT, RodBody(beam), goal_position_m=(0, 0, 1), physics_period_s=0.005)
    data = mujoco.MjData(model)
    data.qpos[:] = rng.uniform(-3, 3, model.nq)
    velocity = rng.normal(size=4 + count)
    heading, pitches = data.qpos[2], 2 + count
    reduction = np.zeros((model.nv, 2 + pitches))
    reduction[0, 0], reduction[1, 0], reduction[2, 1] = np.cos(heading), np.sin(heading), 1.0
    reduction[3:, 2:] = np.eye(pitches) - np.eye(pitches, k=-1)
    turning = np.zeros(model.nv)
    turning[:2] = velocity[0] * velocity[1] * np.array([-np.sin(heading), np.cos(heading)])
    data.qvel[:] = reduction @ velocity
    mujoco.mj_forward(model, data)
    alpha = np.cumsum(data.qpos[3:])
    alpha[2:] -= np.pi / 2
    return beam, model, data, alpha, velocity, reduction, turning


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [1, 2, 5])
def test_reduced_mass_matrix_and_bias_agree(count, seed):
    beam, model, data, alpha, velocity, S, turning = random_state(count, seed)
    chain = robot_chain(ROBOT, beam)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    np.testing.assert_allclose(S.T @ inertia @ S, chain.mass_matrix(alpha), atol=1e-9)
    bias = S.T @ (data.qfrc_bias + inertia @ turning)
    np.testing.assert_allclose(bias, chain.bias(alpha, velocity), atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_passive_forces_are_damping_from_the_vertical_and_joint_springs(count):
    beam, _, data, alpha, velocity, S, _ = random_state(count, seed=7)
    model, swing = HangingBeam(beam), alpha[2:] + np.pi / 2
    passive = S.T @ data.qfrc_passive
    np.testing.assert_allclose(passive[:4], 0.0, atol=1e-9)
    expected = -(model.d_o22 @ velocity[4:] + model.k_o22 @ swing)
    np.testing.assert_allclose(passive[4:], expected, atol=1e-9)


def test_batched_terms_equal_single_ones():
    rng = np.random.default_rng(3)
    chain = robot_chain(ROBOT, BeamParams(segment_count=2))
    alpha, velocity = rng.normal(size=(6, 4)), rng.normal(size=(6, 6))
    inertia, bias = chain.mass_matrix(alpha), chain.bias(alpha, velocity)
    for k in range(6):
        np.testing.assert_allclose(inertia[k], chain.mass_matrix(alpha[k]))
        np.testing.assert_allclose(bias[k], chain.bias(alpha[k], velocity[k]))
