import math

import mujoco
import numpy as np
import pytest

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.dynamics.feedback_linearization import FeedbackLinearization
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution

SIGMA = math.pi / 6
WEIGHT_N = BeamParams().mass_kg * 9.81


def forces_for(plant, beam, w):
    """Return T_r that accelerate the grasp by w, (n, 3)."""
    resolution = RedundancyResolution(RobotParams(), goal_reach_m=0.7)
    state = plant.read()
    return FeedbackLinearization(RobotParams(), beam, resolution).generalized_forces(
        np.broadcast_to(np.asarray(w, float), (plant.count, 3)),
        state.joints,
        state.joint_rates,
        state.base_velocity,
        state.swing,
        state.swing_rate,
    )


def energy(plant):
    data = mujoco.MjData(plant.model)
    plant.materialize(0, plant.model, data)
    mujoco.mj_energyPos(plant.model, data)
    mujoco.mj_energyVel(plant.model, data)
    return data.energy.sum()


def test_beam_at_rest_is_carried_by_its_weight_upwards(make_plant):
    plant = make_plant(count=2)
    plant.hold(np.arange(2), forces_for(plant, BeamParams(), [0, 0, 0]))
    force = plant.read().grasp_force_b
    np.testing.assert_allclose(force, [[0, 0, WEIGHT_N]] * 2, atol=1e-6)


def test_grasp_force_has_the_sign_of_the_force_on_the_object(make_plant):
    plant = make_plant()
    plant.hold(np.arange(1), forces_for(plant, BeamParams(), [1.0, 0, 0.5]))
    expected = [[BeamParams().mass_kg / 4, 0, WEIGHT_N + BeamParams().mass_kg * 0.5]]
    np.testing.assert_allclose(plant.read().grasp_force_b, expected, atol=0.01)


@pytest.mark.parametrize("yaw_rate", [1.0, -1.0])
def test_base_hardly_slips_sideways_while_turning_at_speed(make_plant, yaw_rate):
    plant = make_plant()
    plant._velocity[:, 0], plant._velocity[:, 2] = 1.0, yaw_rate
    slip = []
    for _ in range(100):
        u1, u2 = plant.read().base_velocity[0]
        w = [2 * (1 - u1) - 0.7 * u2**2, u1 * u2 + 1.4 * (yaw_rate - u2), 0]
        plant.apply(forces_for(plant, BeamParams(), w))
        plant.step(4)
        slip.append(plant.read().lateral_speed[0])
    np.testing.assert_allclose(plant.read().base_velocity, [[1.0, yaw_rate]], atol=0.02)
    assert np.abs(slip).max() < 2e-3


def test_turning_base_follows_the_circle_of_a_unicycle(make_plant):
    plant = make_plant()
    plant._velocity[:, 0], plant._velocity[:, 2] = 1.0, 1.0
    path = []
    for _ in range(300):
        u1, u2 = plant.read().base_velocity[0]
        w = [2 * (1 - u1) - 0.7 * u2**2, u1 * u2 + 1.4 * (1 - u2), 0]
        plant.apply(forces_for(plant, BeamParams(), w))
        plant.step(4)
        path.append(plant.read().base_pose[0])
    heading = np.array(path)[:, 2]
    center = np.array(path)[:, :2] + np.stack((-np.sin(heading), np.cos(heading)), axis=1)
    # the instantaneous centre of a 1 m circle stands still
    assert np.ptp(center[50:], axis=0).max() < 0.03


def test_undamped_motion_conserves_energy(make_plant):
    beam = BeamParams(damping=0.0, joint_damping=0.0, segment_count=2)
    plant = make_plant(beam, physics_period_s=5e-4, joints=(-1.2, -0.3), swing=0.4)
    plant._velocity[:, 2] = 0.7
    start = energy(plant)
    kinetic = []
    for _ in range(20):
        plant.step(100)
        assert abs(energy(plant) - start) < 0.01
        kinetic.append(np.abs(plant.read().swing_rate).max())
    assert max(kinetic) > 1.0


def test_damping_takes_the_energy_that_it_should(make_plant):
    beam = BeamParams(damping=0.3)
    plant = make_plant(beam, physics_period_s=5e-4, joints=(-1.2, -0.3), swing=0.4)
    start, dissipated = energy(plant), 0.0
    energies = [start]
    for _ in range(200):
        before = plant.read().swing_rate[0, 0]
        plant.step(10)
        after = plant.read().swing_rate[0, 0]
        dissipated += 0.005 * beam.damping * (before**2 + after**2) / 2
        energies.append(energy(plant))
    assert dissipated > 0.1
    assert start - energies[-1] == pytest.approx(dissipated, rel=0.02)
    assert np.diff(energies).max() < 2e-3


@pytest.mark.parametrize("substeps", [1, 3])
def test_grasp_force_is_that_of_this_instant(make_plant, substeps):
    plant = make_plant(BeamParams(segment_count=2), swing=0.2)
    lags, errors = [], []
    for k in range(40):
        plant.apply(np.array([[60 * math.cos(k), 8.0, 50 * math.sin(k), 25.0]]))
        plant.step(substeps)
        sensed, force = plant._readings[:, -1].copy(), plant._grasp_force_s.copy()
        plant._batch.forward()
        lags.append(sensed - plant._sensed_force)
        errors.append(force - plant._sensed_force)
    assert np.square(errors).mean() < 0.2**2 * np.square(lags).mean()


def test_diverged_simulation_is_reported_and_the_others_go_on(
    make_plant, tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)  # where MuJoCo would write its warnings to a file
    healthy, sick = make_plant(count=3, swing=0.2), make_plant(count=3, swing=0.2)
    sick._velocity[1, 3] = 1e20
    np.testing.assert_array_equal(sick.step(4), [False, True, False])
    assert not healthy.step(4).any()
    for name in ("base_pose", "joints", "swing", "swing_rate", "grasp_force_b"):
        ours, theirs = getattr(sick.read(), name), getattr(healthy.read(), name)
        np.testing.assert_array_equal(ours[[0, 2]], theirs[[0, 2]])
    sick.place(np.array([1]), np.zeros((1, 3)), np.array([[np.pi / 2, -np.pi / 2]]), [[0.2]])
    assert not sick.step(4).any()
    np.testing.assert_array_equal(sick.read().swing[1], healthy.read().swing[1])
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr().err == ""


def trajectory(plant):
    forces = np.array([60.0, 8.0, 50.0, 25.0])
    states = []
    for k in range(50):
        plant.apply(np.tile(forces * math.cos(0.1 * k), (plant.count, 1)))
        plant.step(4)
        state = plant.read()
        states.append(np.concatenate((state.base_pose, state.swing, state.grasp_force_b), axis=1))
    return np.stack(states)


def test_trajectory_does_not_depend_on_batch_size_or_threads(make_plant):
    alone = trajectory(make_plant(swing=0.1))
    for threads in (1, 2):
        together = trajectory(make_plant(count=7, num_threads=threads, swing=0.1))
        for index in range(7):
            np.testing.assert_array_equal(together[:, index], alone[:, 0])


def swing_under_smooth_acceleration(make_plant, beam, period):
    plant, swing = make_plant(beam, physics_period_s=period), []
    for k in range(250):
        t = 0.02 * k
        plant.apply(forces_for(plant, beam, [math.sin(1.3 * t) * math.sin(0.4 * t), 0, 0]))
        plant.step(round(0.02 / period))
        swing.append(plant.read().swing[0])
    return np.stack(swing)


@pytest.mark.parametrize("segments", [1, 3])
def test_5_ms_steps_are_accurate_to_a_percent_of_sigma(make_plant, segments):
    beam = BeamParams(segment_count=segments)
    coarse, fine = (
        swing_under_smooth_acceleration(make_plant, beam, period) for period in (0.005, 0.0005)
    )
    assert np.abs(fine).max() > 0.1 * SIGMA
    assert np.abs(coarse - fine).max() < 0.01 * SIGMA


def test_push_acts_at_the_grasp(make_plant):
    # a force at the grasp and its generalized forces J_Aᵀ F do the same
    pushed, driven = make_plant(joints=(1.2, -1.5)), make_plant(joints=(1.2, -1.5))
    push = np.array([[3.0, 0.0, -4.0]])
    hold = forces_for(pushed, BeamParams(), [0, 0, 0])
    pushed.apply(hold)
    pushed.push_grasp(push)
    q1, q12 = 1.2, 1.2 - 1.5
    jacobian = np.array(
        [
            [1, 0, -0.6 * math.sin(q1) - 0.7 * math.sin(q12), -0.7 * math.sin(q12)],
            [0, 0, 0.6 * math.cos(q1) + 0.7 * math.cos(q12), 0.7 * math.cos(q12)],
        ]
    )
    driven.apply(hold + push[:, [0, 2]] @ jacobian)
    pushed.step(1)
    driven.step(1)
    np.testing.assert_allclose(pushed.read().joint_rates, driven.read().joint_rates, atol=1e-9)
    np.testing.assert_allclose(pushed.read().base_velocity, driven.read().base_velocity, atol=1e-9)
