"""Feedback linearization (28) in the environment: the grasp accelerates by the action's w."""

import numpy as np
import pytest

from defmanip_gym.params import BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.frames import base_to_world, world_to_base

BEAM = BeamParams(damping=0.1)
TASK = TaskParams()


def accelerations(env, action, starts, steps):
    """Return the mean inertial acceleration over each control period, base frame, (steps, n, 3)."""
    engine = env.unwrapped.engine

    def velocity_w():
        state = engine.plant_state
        part = engine.layout.part(observation, "grasp_velocity_b")
        return base_to_world(part, state.base_pose[:, 2]), state.base_pose[:, 2]

    observation, _ = env.reset(options={"start": starts})
    measured = []
    for k in range(steps):
        before, heading = velocity_w()
        observation, *_ = env.step(action(k))
        after, new_heading = velocity_w()
        mean_heading = (heading + new_heading) / 2
        measured.append(world_to_base(after - before, mean_heading) / TASK.control_period_s)
    return np.stack(measured)


def starts(count, seed=0):
    rng = np.random.default_rng(seed)
    center = np.array([-8.5, 5.5, 0.0, np.pi / 3, -np.pi / 2, 0.0])
    return center + np.array([1, 1, 0.5, 0.1, 0.1, 0.3]) * rng.uniform(-1, 1, (count, 6))


@pytest.mark.parametrize("segments", [1, 3])
def test_grasp_follows_w_when_the_model_is_right(make_batch, segments):
    beam = BeamParams(damping=0.1, segment_count=segments)
    env = make_batch(8, beam=beam, nominal_beam=beam)
    w = np.random.default_rng(1).uniform(-1, 1, (8, 3)) * [1.0, 0.4, 0.1]
    measured = accelerations(env, lambda k: w / TASK.max_acceleration_m_s2, starts(8), 30)
    # the forces stand still for 20 ms while the beam swings on
    assert np.abs(measured - w).max() < 0.12
    assert np.abs((measured - w).mean(axis=0)).max() < 0.03


def test_hold_error_shrinks_with_the_control_period(make_batch):
    errors = []
    for period in (0.02, 0.005):
        task = TaskParams(control_period_s=period, physics_period_s=0.0025)
        env = make_batch(4, beam=BEAM, nominal_beam=BEAM, task=task)
        engine = env.unwrapped.engine
        observation, _ = env.reset(options={"start": starts(4)})
        velocity = engine.layout.part(observation, "grasp_velocity_b")
        for _ in range(round(0.4 / period)):
            observation, *_ = env.step(np.tile([0.2, 0.0, 0.0], (4, 1)))
        gained = engine.layout.part(observation, "grasp_velocity_b") - velocity
        errors.append(np.abs(gained - [0.6 * 0.4, 0, 0]).max())
    assert errors[1] < 0.5 * errors[0]


def test_base_makes_up_for_the_arms_own_motion(make_batch):
    env = make_batch(beam=BEAM, nominal_beam=BEAM)
    engine = env.unwrapped.engine
    observation, _ = env.reset(options={"start": (-8.5, 5.5, 0.3, np.pi / 3, -np.pi / 2, 0.0)})
    offset = engine.layout.part(observation, "goal_offset_b").copy()
    pose, joints = engine.plant_state.base_pose.copy(), engine.plant_state.joints.copy()
    for _ in range(300):
        observation, *_ = env.step(np.zeros((1, 3)))
    # the reach shrinks from 0.9 m to the goal's 0.7 m, and the base drives forward as much
    assert np.abs(engine.plant_state.joints - joints).max() > 0.1
    assert np.linalg.norm(engine.plant_state.base_pose - pose) > 0.1
    moved = engine.layout.part(observation, "goal_offset_b") - offset
    assert np.abs(moved).max() < 0.03  # open loop, forces held for 20 ms


def test_unbelieved_damping_of_the_beam_only_damps(make_batch):
    # the environment's default counts on none: swing must decay faster than the free beam's
    decay = []
    for believed in (1.0, 0.0):
        env = make_batch(beam=BeamParams(damping=1.0), nominal_beam=BeamParams(damping=believed))
        engine = env.unwrapped.engine
        env.reset(options={"start": (0, 0, 0, np.pi / 2, -np.pi / 2, 0.1)})
        for _ in range(100):
            env.step(np.zeros((1, 3)))
        state = engine.plant_state
        decay.append(np.hypot(4.95 * state.swing[0, 0], state.swing_rate[0, 0]))
    assert decay[1] < decay[0]
