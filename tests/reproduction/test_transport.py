"""The slow transport, shortened, and the pieces that make it affordable."""

import numpy as np
import pytest

from defmanip_gym.errors import DivergenceError
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.reproduction.course import FORCE_ERROR, JOINTS, POSITION, VELOCITY
from defmanip_gym.reproduction.local_model import local_model
from defmanip_gym.reproduction.setting import SIGMA_RAD, paper_setting
from defmanip_gym.reproduction.summary import literal_field_duration, sampled_loop, summarize
from defmanip_gym.reproduction.transport import PaperLoop, has_arrived, run_transport


def nothing(time_s):
    pass


@pytest.fixture(scope="module")
def setting():
    return paper_setting(max_duration_s=31.0)


@pytest.fixture(scope="module")
def course(setting):
    return run_transport(setting, nothing)


def test_setting_is_that_of_section_vi(setting):
    assert setting.nu_max == pytest.approx(1.089e-3, rel=1e-3)
    assert setting.speed_bound == pytest.approx(setting.nu_max / 2)
    assert setting.tracking_gain == pytest.approx(1.089e-3, rel=1e-3)
    assert setting.environment.beam.damping == 0.1
    assert setting.environment.disturbance.force_amplitude_n == 0.005
    assert setting.environment.disturbance.force_bias_n == 0.05


def test_swing_and_speed_stay_within_their_bounds(setting, course):
    assert course.largest_swing_rad < 1e-3 * SIGMA_RAD
    assert (course.largest_velocity_m_s <= 1.02 * setting.speed_bound).all()
    assert course.time_s[-1] == pytest.approx(31.0, abs=2.1)


def test_force_error_decays_although_bias_and_noise_go_on(course):
    early = np.abs(course.opening[course.opening_time_s < 0.1, FORCE_ERROR]).max(axis=0)
    late = np.abs(course.opening[course.opening_time_s > 1.0, FORCE_ERROR]).max(axis=0)
    assert (early > 3e-3).all()
    assert (late < 0.02 * early).all()


def test_arm_takes_the_reach_of_the_goal(setting, course):
    kinematics = PaperLoop(setting)._kinematics
    q1, q2 = course.last[-1, JOINTS]
    reach, _ = kinematics.reach_and_height(np.array([q1, q1 + q2]))
    assert reach == pytest.approx(setting.environment.goal_reach_and_height_m[0], abs=0.03)


def test_same_setting_gives_identical_numbers():
    short = paper_setting(max_duration_s=3.0)
    first, second = (summarize(short, run_transport(short, nothing)) for _ in range(2))
    assert first == second


def test_arrival_needs_place_and_rest(setting):
    window = np.zeros((5, 15))
    assert has_arrived(window, setting)
    window[2, VELOCITY.start] = 2e-4
    assert not has_arrived(window, setting)
    window[2] = 0.0
    window[4, POSITION.start] = 0.02
    assert not has_arrived(window, setting)


def test_the_sampled_loop_is_stable_in_every_stage(setting):
    for stage in setting.stages:
        assert sampled_loop(setting, stage).spectral_radius() < 1.0
        physics = setting.environment.task.physics_period_s
        assert round(stage.period_s / physics) % 2 == 1  # the force is read in the middle


def test_literal_field_would_take_weeks(setting, course):
    duration = literal_field_duration(setting, course.opening[0, POSITION])
    assert 20 * 86400 < duration < 200 * 86400


def test_expansions_agree_with_the_laws_that_they_stand_for(setting):
    loop = PaperLoop(setting)
    loop.enter(setting.stages[-1])
    generator = np.random.default_rng(0)
    at = np.array([0, 0, 0, 1.2, -1.6, 1e-3, -1e-3, 5e-4, 1e-4, 1e-4, 5e-4])
    moved = at + 1e-4 * generator.uniform(-1, 1, (20, at.size))
    model = local_model(loop._force_function, at)
    np.testing.assert_allclose(model(moved), loop._force_function(moved), atol=1e-5)
    at = np.array([1e-4, 5e-4, 1e-4, 0.0, 0.0, 30.56, 0.0, 0.0, 0.0])
    moved = at + 1e-4 * generator.uniform(-1, 1, (20, at.size))
    model = local_model(loop._error_function, at)
    np.testing.assert_allclose(model(moved), loop._error_function(moved), atol=1e-6)


def test_divergence_is_reported(setting, monkeypatch):
    monkeypatch.setattr(Simulation, "step", lambda self, substeps: np.ones(1, dtype=bool))
    with pytest.raises(DivergenceError, match="diverge"):
        run_transport(setting, nothing)
